#include "tools/sim/inertial.h"

#include <cmath>

#include "tools/sim/random.h"

namespace relmap::sim {
namespace {

constexpr double kGravity = 9.81;  // m/s^2, along the world's y

Vector3 normal3(sim::Random& random) {
  const double x = random.normal(), y = random.normal(), z = random.normal();
  return {x, y, z};
}

ImuSample exact(const sim::Motion& m, const InertialOptions& options) {
  const Vector3 &w = m.angular_velocity, &dw = m.angular_acceleration, &arm = options.position;
  const Vector3 of_camera = m.T_world_left.R.transpose() * (m.acceleration - Vector3(0, kGravity, 0));
  const Matrix3 R_imu_camera = options.calibration.R_camera_imu.transpose();
  return {0, R_imu_camera * w, R_imu_camera * (of_camera + dw.cross(arm) + w.cross(w.cross(arm)))};
}

}  // namespace

std::vector<ImuSample> simulate_inertial(const PictureWorld& world, const InertialOptions& options) {
  const PictureWorldOptions& drive = world.options();
  const auto count = static_cast<std::int64_t>(std::floor((drive.frames - 1) / drive.rate * options.rate + 1e-9)) + 1;
  const double density_to_sample = std::sqrt(options.rate), walk_to_step = 1 / std::sqrt(options.rate);
  sim::Random random(options.seed, 21);
  Vector3 gyro_bias = options.gyro_bias * normal3(random);
  Vector3 acceleration_bias = options.acceleration_bias * normal3(random);
  std::vector<ImuSample> samples;
  for (std::int64_t k = 0; k < count; ++k) {
    const double t = static_cast<double>(k) / options.rate;
    ImuSample sample = exact(world.motion_at(t), options);
    sample.time_us = drive.start_us + std::llround((t + options.time_offset) * 1e6);
    sample.gyro += gyro_bias + options.calibration.gyro_noise * density_to_sample * normal3(random);
    sample.acceleration += acceleration_bias + options.acceleration_noise * density_to_sample * normal3(random);
    gyro_bias += options.calibration.gyro_walk * walk_to_step * normal3(random);
    acceleration_bias += options.acceleration_walk * walk_to_step * normal3(random);
    samples.push_back(sample);
  }
  return samples;
}

}  // namespace relmap::sim
