// Any text as a daemon's access list, and as a caller's credentials: what is read is written and read again alike.
#include <cstdint>
#include <cstdlib>

#include "proto/access/access_list.h"
#include "proto/access/certificate.h"
#include "proto/access/credentials.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  namespace access = relmap::access;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  if (const auto list = access::AccessList::parse(text, "file"); list.ok()) {
    const auto again = access::AccessList::parse(list->text(), "file");
    if (!again.ok() || again->grants() != list->grants()) std::abort();
  }
  if (const auto credentials = access::parse_credentials(text); credentials.ok()) {
    const auto again = access::parse_credentials(access::text_of(*credentials));
    if (!again.ok() || again->token != credentials->token || again->robot_key != credentials->robot_key ||
        again->key != credentials->key || again->certificate != credentials->certificate ||
        again->authorities != credentials->authorities)
      std::abort();
  }
  if (const auto facts = access::read_certificate(text); facts.ok() && facts->principal)
    if (access::principal_of(access::uri_of(*facts->principal)) != facts->principal) std::abort();
  return 0;
}
