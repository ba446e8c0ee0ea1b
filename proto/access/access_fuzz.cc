// Any text as a daemon's access list, as a caller's credentials and as a certificate: what is read is written and read
// again alike, and who an access list lets in can be given a certificate that says so.
#include <algorithm>

#include "proto/access/access_list.h"
#include "proto/access/certificate.h"
#include "proto/access/credentials.h"
#include "proto/base/testing/fuzzing.h"

namespace {

using namespace relmap;
using namespace relmap::access;
using fuzzing::must;

constexpr std::size_t kIssued = 2;  // certificates an input: each takes a millisecond

void try_list(std::string_view text) {
  static const KeyPair kAuthority = new_authority("fuzz", 1);
  const auto list = AccessList::parse(text, "file");
  if (!list.ok()) return;
  auto again = AccessList::parse(list->text(), "file");
  must(again.ok() && again->grants() == list->grants());
  std::size_t issued = 0;
  for (const Grant& grant : list->grants()) {
    must(list->find(grant.kind, grant.hash) != nullptr && kind_name(grant.kind) != "");
    must(role_of(role_name(grant.principal.role)) == grant.principal.role);
    must(time_of(time_text(grant.expires_s)) == grant.expires_s);
    (void)again->revoke(grant.principal.name);
    must(again->revoke(grant.principal.name) == 0 && again->find(grant.kind, grant.hash)->revoked);
    if (issued++ == kIssued) continue;
    const std::vector<std::string> hosts{"localhost", "127.0.0.1", "::1"};
    const auto pair = issue(kAuthority, {"fuzz", hosts, grant.principal, 1});
    must(pair.ok() && check_key_pair(*pair).ok() && !check_key_pair({pair->certificate, kAuthority.key}).ok());
    const auto facts = read_certificate(pair->certificate);
    must(facts.ok() && facts->principal == grant.principal && facts->hosts == hosts && facts->expires_s > 0);
  }
}

void try_credentials(std::string_view text) {
  const auto credentials = parse_credentials(text);
  if (!credentials.ok()) return;
  const auto again = parse_credentials(text_of(*credentials));
  must(again.ok() && again->token == credentials->token && again->robot_key == credentials->robot_key &&
       again->key == credentials->key && again->certificate == credentials->certificate &&
       again->authorities == credentials->authorities);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text = fuzzing::text_of({data, size});
  try_list(text);
  try_credentials(text);
  if (const auto facts = read_certificate(text); facts.ok() && facts->principal)
    must(principal_of(uri_of(*facts->principal)) == facts->principal);
  if (const auto principal = principal_of(text)) must(principal_of(uri_of(*principal)) == principal);
  // No authority, but a text that may hold anything.
  must(!issue({std::string(text), ""}, {"fuzz", {}, std::nullopt, 1}).ok());
  return 0;
}
