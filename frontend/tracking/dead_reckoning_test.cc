#include "frontend/tracking/dead_reckoning.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace relmap::tracking {
namespace {

constexpr double kDt = 0.1;

SE3 motion(const Vector3& velocity, const Vector3& turn, double dt) {
  Vector6 xi;
  xi << velocity * dt, turn * dt;
  return SE3::exp(xi);
}

// After a second of the same motion.
DeadReckoning steady(const Vector3& velocity, const Vector3& turn = Vector3::Zero()) {
  DeadReckoning reckoning;
  for (int i = 0; i < 10; ++i) reckoning.sensed(motion(velocity, turn, kDt), kDt);
  return reckoning;
}

TEST(DeadReckoning, ExpectsNoMotionBeforeTheFirstMeasurement) {
  const DeadReckoning reckoning;
  EXPECT_FALSE(reckoning.knows_velocity());
  const auto step = reckoning.expect(kDt);
  EXPECT_EQ(step.T_from_to.t, Vector3::Zero());
  EXPECT_LT(rotation_angle(step.T_from_to.R), 1e-12);
  EXPECT_GT(step.covariance(0, 0), 0);
  EXPECT_GT(step.covariance(3, 3), 0);
}

TEST(DeadReckoning, ContinuesAConstantVelocity) {
  const Vector3 velocity{0.2, -0.1, 3}, turn{0.02, -0.3, 0.1};
  DeadReckoning reckoning = steady(velocity, turn);
  EXPECT_TRUE(reckoning.knows_velocity());
  for (const double dt : {0.03, 0.1, 0.4}) {
    const SE3 error = reckoning.expect(dt).T_from_to.inverse() * motion(velocity, turn, dt);
    EXPECT_LT(error.log().norm(), 1e-9) << dt;
  }
  // The translation goes on as long as nothing is seen.
  for (int i = 0; i < 30; ++i) {
    const auto step = reckoning.expect(kDt);
    EXPECT_NEAR(step.T_from_to.log().head<3>().norm(), velocity.norm() * kDt, 1e-9);
    reckoning.unsensed(kDt);
  }
  EXPECT_NEAR(reckoning.blind_s(), 3, 1e-9);
}

TEST(DeadReckoning, PredictsByTheLastPairAndBridgesBySmoothedVelocity) {
  DeadReckoning reckoning = steady({0, 0, 2});
  reckoning.sensed(motion({0, 0, 3}, Vector3::Zero(), kDt), kDt);
  EXPECT_NEAR(reckoning.expect(kDt).T_from_to.t.z(), 0.3, 1e-9);
  reckoning.unsensed(kDt);
  const double later = reckoning.expect(kDt).T_from_to.t.z();
  EXPECT_GT(later, 0.2);
  EXPECT_LT(later, 0.25);
}

TEST(DeadReckoning, RotationDecays) {
  const Vector3 turn{0, 0.5, 0};
  DeadReckoning reckoning = steady({0, 0, 1}, turn);
  double before = rotation_angle(reckoning.expect(kDt).T_from_to.R), sum = before;
  EXPECT_NEAR(before, 0.05, 1e-9);
  for (int i = 0; i < 30; ++i) {
    reckoning.unsensed(kDt);
    const double now = rotation_angle(reckoning.expect(kDt).T_from_to.R);
    EXPECT_LT(now, before);
    before = now;
    sum += now;
  }
  EXPECT_LT(before, 0.001);
  EXPECT_LT(sum, 0.5);  // in all no more than a second's
}

// For steps of any length, the variances add up to the error of a speed that is wrong and changes.
TEST(DeadReckoning, UncertaintyOfTranslationAddsUpOverSteps) {
  const double speed = 4;
  for (const double dt : {0.02, 0.1, 0.5}) {
    DeadReckoning reckoning = steady({0, 0, speed});
    double variance = 0;
    for (double t = dt; t < 3.001; t += dt) {
      const auto step = reckoning.expect(dt);
      for (int k = 0; k < 3; ++k) EXPECT_EQ(step.covariance(k, k), step.covariance(0, 0));
      variance += step.covariance(2, 2);
      reckoning.unsensed(dt);
      const double drift = 0.05 * speed * t + 0.5 * 1.0 * t * t;  // 5 % of the speed, and 1 m/s^2
      EXPECT_NEAR(variance, drift * drift, 1e-9) << dt << ' ' << t;
    }
  }
}

// This holds for a turn that was not measured and for a gyro's bias: smaller steps do not give less uncertainty.
TEST(DeadReckoning, UncertaintyOfRotationAddsUpOverSteps) {
  const double noise = 0.0005, bias = 0.001;
  for (const double dt : {0.02, 0.1, 0.5}) {
    DeadReckoning reckoning = steady({0, 0, 1});
    const Gyro::Turn turn{Matrix3::Identity(), noise * std::sqrt(dt), bias};
    double blind = 0, by_gyro = 0;
    for (double t = dt; t < 4.001; t += dt) {
      const auto without = reckoning.expect(dt), with = reckoning.expect(dt, &turn);
      blind += without.covariance(4, 4);
      by_gyro += with.covariance(4, 4);
      reckoning.unsensed(dt);
      EXPECT_NEAR(std::sqrt(blind), 0.3 * t * std::min(1.0, 0.2 + t), 1e-9) << dt << ' ' << t;
      EXPECT_NEAR(by_gyro, noise * noise * t + bias * bias * t * t, 1e-12) << dt << ' ' << t;
    }
  }
}

TEST(DeadReckoning, AGivenTurnReplacesTheRotation) {
  const Gyro::Turn turn{so3_exp({0.01, 0.2, -0.03}), 0.002, 0};
  DeadReckoning reckoning = steady({0, 0, 1}, {0, -0.4, 0});
  for (int i = 0; i < 5; ++i) {
    const auto with = reckoning.expect(kDt, &turn), without = reckoning.expect(kDt);
    EXPECT_EQ(with.T_from_to.R, turn.R_from_to);
    EXPECT_EQ(with.T_from_to.t, without.T_from_to.t);
    for (int k = 3; k < 6; ++k) EXPECT_NEAR(with.covariance(k, k), 0.002 * 0.002, 1e-15);
    EXPECT_EQ(with.covariance(0, 0), without.covariance(0, 0));
    reckoning.unsensed(kDt);
  }
}

TEST(DeadReckoning, PicturesThatLookDifferentWidenTheRotation) {
  const DeadReckoning reckoning = steady({0, 0, 1});
  const auto usual = reckoning.expect(0.2), unlike = reckoning.expect(0.2, nullptr, true);
  EXPECT_EQ(unlike.T_from_to.R, usual.T_from_to.R);
  EXPECT_EQ(unlike.covariance(0, 0), usual.covariance(0, 0));
  // A head turns at 190 degrees a second.
  const double turn = 190 * std::numbers::pi / 180 * 0.2;
  EXPECT_GT(turn, 10 * std::sqrt(usual.covariance(4, 4)));
  EXPECT_LT(turn, 2 * std::sqrt(unlike.covariance(4, 4)));
}

TEST(DeadReckoning, KnowsTheVelocityAtOnceWhenItSeesAgain) {
  DeadReckoning reckoning = steady({0, 0, 1});
  reckoning.unsensed(2);
  reckoning.found();
  EXPECT_EQ(reckoning.blind_s(), 0);
  reckoning.unsensed(1);
  reckoning.sensed(motion({0, 0, 5}, Vector3::Zero(), kDt), kDt);
  EXPECT_EQ(reckoning.blind_s(), 0);
  EXPECT_NEAR(reckoning.expect(kDt).T_from_to.t.z(), 5 * kDt, 1e-9);
  reckoning.unsensed(kDt);
  EXPECT_NEAR(reckoning.expect(kDt).T_from_to.t.z(), 5 * kDt, 1e-9);
}

}  // namespace
}  // namespace relmap::tracking
