// The parts of an LCM URL: provider://network?option=value&...
#pragma once

#include <string>

#include "proto/base/status.h"

namespace relmap {

struct LcmUrl {
  std::string provider;  // udpm, file, memq
  std::string network;   // udpm: GROUP:PORT; file: the path of a log; memq: nothing
  std::string options;   // without the question mark
};
// INVALID_ARGUMENT: no URL, or of another provider.
Result<LcmUrl> parse_lcm_url(const std::string& url);

// Whether LCM would take all of it as it is meant; by itself LCM only warns of what it cannot read, and goes on with
// its defaults. INVALID_ARGUMENT, with what is wrong: a group that is no IPv4 multicast address, a port, a path that is
// missing, an option that is unknown, given twice, or has a value that it cannot have.
Status check_lcm_url(const LcmUrl& url);

// "" if it is not there.
std::string lcm_option(const LcmUrl& url, const std::string& name);

// A log that is being read.
bool is_replay(const std::string& url);

}  // namespace relmap
