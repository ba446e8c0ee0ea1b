// The calibration of an inertial unit as data sets write it: EuRoC's imu0/sensor.yaml.
#pragma once

#include <string_view>

#include "proto/base/status.h"
#include "proto/geometry/geometry.h"

namespace relmap {

inline constexpr double kMaxTimeShiftS = 10;

struct ImuSensor {
  SE3 T_body_imu;           // p_body = T_body_imu p_imu, metres; the body of StereoCalibration::T_body_left
  double gyro_noise = 0;    // rad/s/sqrt(Hz), as in ImuCalibration
  double gyro_walk = 0;     // rad/s^2/sqrt(Hz)
  double time_shift_s = 0;  // of the unit's clock against the cameras': t_imu = t_camera + shift
};

// T_BS, gyroscope_noise_density, gyroscope_random_walk, and kalibr's timeshift_cam_imu if there is one. CORRUPT: not of
// that format; IMPLAUSIBLE_CALIBRATION: no rotation, noise not in 0..1, clocks more than 10 s apart.
Result<ImuSensor> parse_imu_calibration(std::string_view text);

}  // namespace relmap
