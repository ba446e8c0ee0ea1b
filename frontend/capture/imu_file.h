// Recordings of inertial units: EuRoC's imu0/data.csv with its sensor.yaml, imu.csv with imu.yaml.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "proto/base/status.h"
#include "proto/calibration/imu.h"

namespace relmap::capture {

// Lines "nanoseconds, gyro x, y, z (rad/s), acceleration x, y, z (m/s^2)"; # begins a comment. Relative times (below
// 10^9 s) are placed as those of pictures are (capture_time.h). The message says which line. CORRUPT: another line;
// NOT_FINITE; TIME_BACKWARDS: not later, by a microsecond, than the line before; BAD_SIZE: no sample at all.
Result<std::vector<ImuSample>> parse_imu_csv(std::string_view text);

// `path`: such a file, or a folder with data.csv or imu.csv, or one find_imu() finds something in. Beside it stands the
// unit's calibration (proto/calibration/imu_calibration.h), of the same name or as sensor.yaml, without which nobody
// knows which way its axes point. `T_body_camera` is StereoCalibration::T_body_left of the same body. Samples are moved
// to the cameras' clock. NO_SUCH_FILE, IO_ERROR, parse_imu_calibration()'s, and as above; the message names the file.
Result<ImuRecording> read_imu(const std::string& path, const SE3& T_body_camera);

// Where a data set's folder keeps its inertial recording: mav0/imu0, imu0 or imu.csv; empty: nowhere.
std::string find_imu(const std::string& folder);

}  // namespace relmap::capture
