// The parts of an LCM URL: provider://network?option=value&...
#pragma once

#include <string>

#include "proto/status.h"

namespace relmap {

struct LcmUrl {
  std::string provider;  // udpm, file, memq
  std::string network;   // udpm: group:port
  std::string options;   // without the question mark
};
Result<LcmUrl> parse_lcm_url(const std::string& url);

// "" if it is not there.
std::string lcm_option(const LcmUrl& url, const std::string& name);

// A log that is being read.
bool is_replay(const std::string& url);

}  // namespace relmap
