// Parses and checks LCM URLs: provider://network?option=value&...
#pragma once

#include <string>

#include "proto/base/status.h"

namespace relmap {

struct LcmUrl {
  std::string provider;  // udpm, file, memq
  std::string network;   // udpm: GROUP:PORT; file: the path of a log; memq: empty
  std::string options;   // without the question mark
};
// INVALID_ARGUMENT: not a URL, or of another provider.
Result<LcmUrl> parse_lcm_url(const std::string& url);

// Checks all parts of a URL, since LCM only warns of what it cannot read and continues with its defaults.
// INVALID_ARGUMENT, with what is wrong: a group that is no IPv4 multicast address, a bad port, a missing path, or an
// option that is unknown, given twice, or out of range.
Status check_lcm_url(const LcmUrl& url);

// The value of an option; "" if it is not given.
std::string lcm_option(const LcmUrl& url, const std::string& name);

// True if the URL reads a log.
bool is_replay(const std::string& url);

}  // namespace relmap
