// What the calibration parsers share.
#pragma once

#include <cstddef>

namespace relmap {

inline constexpr std::size_t kMaxCalibrationBytes = 256 * 1024;

}  // namespace relmap
