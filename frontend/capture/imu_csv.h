// Reads the lines of a recording of an inertial unit (imu_file.h).
#pragma once

#include <string_view>
#include <vector>

#include "proto/base/status.h"
#include "proto/calibration/imu.h"

namespace relmap::capture {

// Parses lines "nanoseconds, gyro x, y, z (rad/s), acceleration x, y, z (m/s^2)"; # begins a comment. Relative times
// (below 10^9 s) are treated as those of pictures (capture_time.h). CORRUPT if a line is malformed; NOT_FINITE;
// TIME_BACKWARDS if a line is not later than the one before by at least a microsecond; BAD_SIZE if there is no sample.
// The message has the line.
Result<std::vector<ImuSample>> parse_imu_csv(std::string_view text);

}  // namespace relmap::capture
