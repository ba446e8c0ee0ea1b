// Any text as an LCM URL: it is refused with a named reason, or completed to one that is complete.
#include <string>

#include "proto/base/testing/fuzzing.h"
#include "proto/wire/lcm_link.h"
#include "proto/wire/lcm_url.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace relmap;
  using fuzzing::must;
  const std::string text(fuzzing::text_of({data, size}));
  const auto parsed = parse_lcm_url(text);
  const auto complete = complete_lcm_url(text);
  if (!parsed.ok()) {
    must(parsed.reason() == Reason::INVALID_ARGUMENT && complete.reason() == Reason::INVALID_ARGUMENT);
    must(!is_replay(text) && !stays_on_this_machine(text));
    return 0;
  }
  const Status checked = check_lcm_url(*parsed);
  must(checked.reason() == complete.reason());
  if (!checked.ok()) return 0;
  const auto again = parse_lcm_url(*complete);
  must(again.ok() && again->provider == parsed->provider && again->network == parsed->network);
  must(check_lcm_url(*again).ok() && complete_lcm_url(*complete).or_throw() == *complete);
  must(is_replay(text) == is_replay(*complete));
  if (parsed->provider == "udpm") must(!lcm_option(*again, "ttl").empty());
  must(stays_on_this_machine(*complete) == (parsed->provider != "udpm" || std::stoi(lcm_option(*again, "ttl")) == 0));
  return 0;
}
