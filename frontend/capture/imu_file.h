// Reads recordings of inertial units: EuRoC's imu0/data.csv with its sensor.yaml, or imu.csv with imu.yaml.
#pragma once

#include <string>

#include "proto/base/status.h"
#include "proto/calibration/imu.h"

namespace relmap::capture {

// Reads `path`: such a file, or a folder with data.csv or imu.csv, or a folder in which find_imu() finds one. The
// unit's calibration (proto/calibration/imu_calibration.h) must be beside it, under the same name or as sensor.yaml,
// since it says how the axes are oriented. `T_body_camera` is StereoCalibration::T_body_left of the same body. Samples
// are moved to the cameras' clock. NO_SUCH_FILE, IO_ERROR, and the reasons of parse_imu_calibration() and
// parse_imu_csv() (imu_csv.h); the message names the file.
Result<ImuRecording> read_imu(const std::string& path, const SE3& T_body_camera);

// The inertial recording of a data set's folder: mav0/imu0, imu0 or imu.csv; empty if there is none.
std::string find_imu(const std::string& folder);

}  // namespace relmap::capture
