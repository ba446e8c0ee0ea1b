// Parses the calibration of an inertial unit, in the format of EuRoC's imu0/sensor.yaml.
#pragma once

#include <string_view>

#include "proto/base/status.h"
#include "proto/geometry/geometry.h"

namespace relmap {

inline constexpr double kMaxTimeShiftS = 10;

struct ImuSensor {
  SE3 T_body_imu;           // p_body = T_body_imu p_imu, metres; the same body as in StereoCalibration::T_body_left
  double gyro_noise = 0;    // rad/s/sqrt(Hz), as in ImuCalibration
  double gyro_walk = 0;     // rad/s^2/sqrt(Hz)
  double time_shift_s = 0;  // how far the unit's clock is ahead of the cameras': t_imu = t_camera + shift
};

// Reads T_BS, gyroscope_noise_density, gyroscope_random_walk, and kalibr's timeshift_cam_imu if there is one. CORRUPT:
// the text is not of that format; IMPLAUSIBLE_CALIBRATION: T_BS is no rotation, noise or walk is not in 0..1 (noise not
// above 0), or the clocks are more than kMaxTimeShiftS apart.
Result<ImuSensor> parse_imu_calibration(std::string_view text);

}  // namespace relmap
