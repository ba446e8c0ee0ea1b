#include "frontend/tracking/gyro.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace relmap::tracking {
namespace {

constexpr std::int64_t kStart = 1'600'000'000'000'000;

// A head that shakes: the rate of turn in its own axes.
Vector3 rate(double t) { return {0.3 * std::sin(2 * t), 0.5 * std::cos(1.3 * t), 0.2 * std::sin(3 * t + 1)}; }

Matrix3 truth(double from, double to) {
  Matrix3 R = Matrix3::Identity();
  const double step = 1e-4;
  for (double t = from; t < to - 1e-9; t += step) R *= so3_exp(rate(t + step / 2) * step);
  return R;
}

std::vector<ImuSample> samples(double seconds, const ImuCalibration& calibration, const Vector3& bias, bool noisy) {
  std::mt19937 random(4);
  std::normal_distribution<double> unit(0, 1);
  std::vector<ImuSample> result;
  for (int i = 0; i * 0.005 <= seconds; ++i) {
    ImuSample sample;
    sample.time_us = kStart + i * 5000;
    sample.acceleration.setZero();
    sample.gyro = calibration.R_camera_imu.transpose() * rate(i * 0.005) + bias;
    if (noisy)
      for (int k = 0; k < 3; ++k) sample.gyro[k] += calibration.gyro_noise * std::sqrt(200.0) * unit(random);
    result.push_back(sample);
  }
  return result;
}

std::int64_t at(double t) { return kStart + std::llround(t * 1e6); }

TEST(Gyro, IntegratesInTheCamerasAxesBetweenAnyTwoTimes) {
  ImuCalibration calibration;
  calibration.R_camera_imu = so3_exp({0.4, 1.1, -0.3});
  Gyro gyro(calibration);
  gyro.add(samples(5, calibration, Vector3::Zero(), false));
  for (const auto& [from, to] : {std::pair{0.0, 0.1}, {0.5021, 1.7}, {1.0, 4.9987}}) {
    const auto turn = gyro.turn(at(from), at(to));
    ASSERT_TRUE(turn.has_value());
    EXPECT_LT(rotation_angle(truth(from, to).transpose() * turn->R_from_to), 2e-4) << from;
  }
}

TEST(Gyro, LearnsItsBiasFromVisionAndBridgesTenSecondsWithoutVision) {
  ImuCalibration calibration;
  calibration.R_camera_imu = so3_exp({0.1, -0.2, 1.5});
  const Vector3 bias(0.012, -0.007, 0.004);
  Gyro gyro(calibration);
  gyro.add(samples(40, calibration, bias, true));
  std::mt19937 random(9);
  std::normal_distribution<double> noise(0, 0.0006);
  for (double t = 0; t < 29.95; t += 0.1) {
    const Matrix3 seen = truth(t, t + 0.1) * so3_exp({noise(random), noise(random), noise(random)});
    gyro.correct(at(t), at(t + 0.1), seen, 0.0006);
  }
  EXPECT_LT((gyro.bias() - bias).norm(), 6e-4);
  const auto turn = gyro.turn(at(30), at(40));
  ASSERT_TRUE(turn.has_value());
  const double error = rotation_angle(truth(30, 40).transpose() * turn->R_from_to);
  EXPECT_LT(error, 0.5 * M_PI / 180);
  EXPECT_LT(error, 3 * std::sqrt(3.0) * std::hypot(turn->noise, 10 * turn->bias_sigma));
}

TEST(Gyro, SaysNothingWhereItHasNoSamples) {
  const ImuCalibration calibration;
  auto all = samples(2, calibration, Vector3::Zero(), false);
  std::erase_if(all, [](const ImuSample& s) { return s.time_us > at(1) && s.time_us < at(1.1); });
  Gyro gyro(calibration);
  EXPECT_FALSE(gyro.turn(at(0), at(1)).has_value());
  gyro.add(all);
  EXPECT_TRUE(gyro.turn(at(0), at(0.9)).has_value());
  EXPECT_FALSE(gyro.turn(at(0.9), at(1.05)).has_value());
  EXPECT_FALSE(gyro.turn(at(-1), at(0.5)).has_value());
  EXPECT_FALSE(gyro.turn(at(1.5), at(2.5)).has_value());
  EXPECT_FALSE(gyro.turn(at(1.5), at(1.5)).has_value());
  gyro.forget_before(at(1.5));
  EXPECT_FALSE(gyro.turn(at(1.2), at(1.6)).has_value());
  EXPECT_TRUE(gyro.turn(at(1.5), at(1.6)).has_value());
}

TEST(Gyro, IsNotMisledByAWrongRotation) {
  const ImuCalibration calibration;
  Gyro gyro(calibration);
  gyro.add(samples(10, calibration, Vector3::Zero(), false));
  for (double t = 0; t < 5; t += 0.1) gyro.correct(at(t), at(t + 0.1), truth(t, t + 0.1), 0.0005);
  gyro.correct(at(6), at(6.1), so3_exp({0.2, 0, 0}), 0.0005);
  EXPECT_LT(gyro.bias().norm(), 1e-3);
}

}  // namespace
}  // namespace relmap::tracking
