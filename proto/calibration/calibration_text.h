// What the calibration parsers share.
#pragma once

#include <sstream>
#include <string>

#include "proto/base/status.h"

namespace relmap {

inline constexpr std::size_t kMaxCalibrationBytes = 256 * 1024;

// A status whose message is `parts`, streamed one after the other.
template <typename... Parts>
Status refuse_calibration(Reason reason, const Parts&... parts) {
  std::ostringstream text;
  (text << ... << parts);
  return {reason, text.str()};
}

}  // namespace relmap
