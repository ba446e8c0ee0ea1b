// Measurements of an inertial unit beside the simulated camera.
#pragma once

#include <cstdint>
#include <vector>

#include "proto/calibration/imu.h"
#include "tools/sim/picture_world.h"

namespace relmap::sim {

struct InertialOptions {
  std::uint64_t seed = 1;              // of the noise
  double rate = 200;                   // samples per second
  ImuCalibration calibration;          // its axes and the gyroscope's noise
  Vector3 position = Vector3::Zero();  // of the unit, in the left camera's axes, metres
  double acceleration_noise = 2e-3;    // m/s^2/sqrt(Hz)
  double acceleration_walk = 3e-3;     // m/s^3/sqrt(Hz)
  double gyro_bias = 0.003;            // standard deviation of each axis at first, rad/s
  double acceleration_bias = 0.05;     // the same, m/s^2
  double time_offset = 0;              // seconds the unit's clock is ahead: its time = the cameras' + offset
};

// Samples from the true time of the first frame to that of the last, stamped by the unit's own clock. Of the faults of
// pictures, only turns of the head affect them.
std::vector<ImuSample> simulate_inertial(const PictureWorld& world, const InertialOptions& options);

}  // namespace relmap::sim
