#include "tools/sim/inertial.h"

#include <gtest/gtest.h>

#include <cmath>

namespace relmap::sim {
namespace {

PictureWorldOptions drive(const std::string& faults = "none") {
  PictureWorldOptions options;
  options.frames = 140;
  EXPECT_TRUE(options.set_faults(faults).ok());
  return options;
}

InertialOptions perfect() {
  InertialOptions options;
  options.calibration.gyro_noise = options.calibration.gyro_walk = 0;
  options.acceleration_noise = options.acceleration_walk = 0;
  options.gyro_bias = options.acceleration_bias = 0;
  return options;
}

// Trapezoids: the rotation from the first sample to the last.
Matrix3 integrated(const std::vector<ImuSample>& samples, std::size_t count, double rate) {
  Matrix3 R = Matrix3::Identity();
  for (std::size_t k = 0; k + 1 < count; ++k) R = R * so3_exp((samples[k].gyro + samples[k + 1].gyro) / (2 * rate));
  return R;
}

TEST(Inertial, ThePerfectGyroIntegratesToTheTrueRotation) {
  for (const char* faults : {"none", "swivel:33,swivel:70"}) {
    const PictureWorld world(drive(faults));
    const InertialOptions options = perfect();
    const auto samples = simulate_inertial(world, options);
    const Matrix3 truth = world.truth(0).R.transpose() * world.truth(100).R;
    const Matrix3 error = truth.transpose() * integrated(samples, 2001, options.rate);
    EXPECT_LT(rotation_angle(error) * 180 / M_PI, 0.01) << faults;
  }
}

TEST(Inertial, SpecificForceIntegratesToTheTrueVelocity) {
  const PictureWorld world(drive("swivel:33"));
  const InertialOptions options = perfect();
  const auto samples = simulate_inertial(world, options);
  Vector3 velocity = world.motion_at(0).velocity;
  for (std::size_t k = 0; k < 2000; ++k) {
    const auto in_world = [&](std::size_t at) -> Vector3 {
      return world.truth_at(static_cast<double>(at) / options.rate).R * samples[at].acceleration;
    };
    velocity += (0.5 * (in_world(k) + in_world(k + 1)) + Vector3(0, 9.81, 0)) / options.rate;
  }
  EXPECT_LT((velocity - world.motion_at(10).velocity).norm(), 0.02);
}

TEST(Inertial, AtRestItMeasuresGravityUpwards) {
  PictureWorldOptions slow = drive();
  slow.rate = 1e-3;
  const PictureWorld world(slow);
  InertialOptions options = perfect();
  options.rate = 1e-2;
  for (const ImuSample& sample : simulate_inertial(world, options)) {
    EXPECT_LT(sample.gyro.norm(), 1e-3);
    EXPECT_NEAR(sample.acceleration.norm(), 9.81, 1e-3);
    EXPECT_LT(sample.acceleration.y(), -9.8);
  }
}

TEST(Inertial, AxesAndLeverArmAreThoseOfTheUnit) {
  const PictureWorld world(drive("swivel:33"));
  InertialOptions turned = perfect();
  turned.calibration.R_camera_imu = so3_exp(Vector3(0.3, -1.2, 2.0));
  InertialOptions aside = perfect();
  aside.position = Vector3(0.1, -0.05, -0.2);
  const auto plain = simulate_inertial(world, perfect()), rotated = simulate_inertial(world, turned),
             moved = simulate_inertial(world, aside);
  double felt = 0;
  for (std::size_t k = 0; k < plain.size(); ++k) {
    EXPECT_LT((turned.calibration.R_camera_imu * rotated[k].gyro - plain[k].gyro).norm(), 1e-12);
    EXPECT_LT((turned.calibration.R_camera_imu * rotated[k].acceleration - plain[k].acceleration).norm(), 1e-12);
    EXPECT_EQ(moved[k].gyro, plain[k].gyro);
    felt = std::max(felt, (moved[k].acceleration - plain[k].acceleration).norm());
  }
  EXPECT_GT(felt, 10);  // in the ramps of the head's turn
  // Midway through the turn little but the centripetal part is left.
  const Vector3 w = plain[680].gyro, force = moved[680].acceleration - plain[680].acceleration;
  EXPECT_LT((force - w.cross(w.cross(aside.position))).norm(), 0.2);
}

TEST(Inertial, TheUnitsClockIsAheadByTheOffset) {
  const PictureWorld world(drive());
  InertialOptions late = perfect();
  late.time_offset = 0.0123;
  const auto plain = simulate_inertial(world, perfect()), shifted = simulate_inertial(world, late);
  ASSERT_EQ(plain.size(), 139U * 20 + 1);
  EXPECT_EQ(plain.front().time_us, world.time_us(0));
  EXPECT_EQ(plain.back().time_us, world.time_us(139));
  for (std::size_t k = 0; k < plain.size(); ++k) {
    EXPECT_EQ(shifted[k].time_us - plain[k].time_us, 12'300);
    EXPECT_EQ(shifted[k].gyro, plain[k].gyro);
  }
}

TEST(Inertial, NoiseHasTheGivenDensity) {
  const PictureWorld world(drive());
  InertialOptions noisy = perfect();
  noisy.calibration.gyro_noise = 1e-3;
  noisy.acceleration_noise = 1e-2;
  InertialOptions biased = perfect();
  biased.acceleration_bias = 0.05;
  const auto plain = simulate_inertial(world, perfect()), noise = simulate_inertial(world, noisy),
             bias = simulate_inertial(world, biased);
  double gyro = 0, acceleration = 0;
  for (std::size_t k = 0; k < plain.size(); ++k) {
    gyro += (noise[k].gyro - plain[k].gyro).squaredNorm() / 3;
    acceleration += (noise[k].acceleration - plain[k].acceleration).squaredNorm() / 3;
  }
  const auto n = static_cast<double>(plain.size());
  EXPECT_NEAR(std::sqrt(gyro / n), 1e-3 * std::sqrt(200), 1e-3);
  EXPECT_NEAR(std::sqrt(acceleration / n), 1e-2 * std::sqrt(200), 1e-2);
  const Vector3 first = bias.front().acceleration - plain.front().acceleration;
  EXPECT_GT(first.norm(), 0.01);
  EXPECT_LT((bias.back().acceleration - plain.back().acceleration - first).norm(), 1e-12);
}

}  // namespace
}  // namespace relmap::sim
