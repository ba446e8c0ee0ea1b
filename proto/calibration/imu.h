// Measurements and calibration of an inertial measurement unit.
#pragma once

#include <cstdint>
#include <vector>

#include "proto/geometry/geometry.h"

namespace relmap {

struct ImuSample {
  std::int64_t time_us = 0;  // UTC, on the cameras' clock
  Vector3 gyro;              // angular velocity in the unit's own axes, rad/s
  Vector3 acceleration;      // specific force in the same axes (a unit at rest measures 9.81 upwards), m/s^2
};

// Noise densities are those of a continuous signal: a sample taken at rate r has standard deviation density * sqrt(r);
// the bias has drifted by walk * sqrt(t) after t seconds.
struct ImuCalibration {
  Matrix3 R_camera_imu = Matrix3::Identity();  // to the axes of the raw (not rectified) left camera
  double gyro_noise = 2e-4;                    // rad/s/sqrt(Hz)
  double gyro_walk = 2e-5;                     // rad/s^2/sqrt(Hz)
};

struct ImuRecording {
  ImuCalibration calibration;
  std::vector<ImuSample> samples;  // ascending by time
};

}  // namespace relmap
