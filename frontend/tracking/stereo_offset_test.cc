#include "frontend/tracking/stereo_offset.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "frontend/tracking/landmark.h"

namespace relmap::tracking {
namespace {

const StereoCamera kCarCamera{700, 620, 187, 0.54, 1240, 376};
constexpr double kNoise = 0.2;  // pixels: what good tracks have
constexpr int kPoints = 100;

// A camera whose eyes are out of line by `truth` pixels.
class Drive {
 public:
  Drive(double truth, unsigned seed) : truth_(truth), random_(seed) {}

  // One keyframe: fresh points, measured from here and after `T_before_after`, and what the offset learns of them.
  void step(const SE3& T_before_after, StereoOffset& offset) {
    std::vector<vision::Correspondence> all;
    while (all.size() < kPoints) {
      const double depth = 5 * std::pow(8.0, unit_(random_));
      const Vector3 point{(unit_(random_) * kCarCamera.width - kCarCamera.cx) / kCarCamera.f * depth,
                          (unit_(random_) * kCarCamera.height - kCarCamera.cy) / kCarCamera.f * depth, depth};
      const Vector3 later = T_before_after.inverse() * point;
      if (later.z() < 1 || !kCarCamera.in_picture(kCarCamera.project(later).x(), kCarCamera.project(later).y()))
        continue;
      vision::Correspondence c;
      from_pixels(kCarCamera, {measured(point, offset), kNoise * kNoise * Matrix3::Identity()}, c.point,
                  c.point_covariance);
      c.pixel = measured(later, offset);
      c.sigma = kNoise;
      all.push_back(c);
    }
    const auto motion = vision::estimate_motion(all, kCarCamera, {}, &T_before_after);
    ASSERT_TRUE(motion.ok());
    std::vector<vision::Correspondence> agreed;
    for (const std::uint32_t i : motion->inliers) agreed.push_back(all[i]);
    offset.learn(agreed, motion->T_reference_camera, kCarCamera);
  }

 private:
  // A disparity that is too large means a u_right that is too small. The offset so far is subtracted, as tracking does.
  StereoPixel measured(const Vector3& point, const StereoOffset& offset) {
    StereoPixel pixel = kCarCamera.project(point);
    for (int k = 0; k < 3; ++k) pixel[k] += kNoise * noise_(random_);
    pixel.z() += offset.pixels() - truth_;
    return pixel;
  }

  double truth_;
  std::mt19937_64 random_;
  std::uniform_real_distribution<double> unit_{0, 1};
  std::normal_distribution<double> noise_{0, 1};
};

const SE3 kForward{so3_exp({0, 0.01, 0}), {0.02, 0, 1}};

TEST(StereoOffset, IsLearntFromDrivingForward) {
  for (const double truth : {0.2, -0.2})
    for (unsigned seed = 1; seed <= 4; ++seed) {
      Drive drive(truth, seed);
      StereoOffset offset;
      for (int i = 0; i < 60; ++i) drive.step(kForward, offset);
      EXPECT_NEAR(offset.pixels(), truth, 0.02) << seed;
      EXPECT_LT(offset.sigma(), 0.05);
    }
}

TEST(StereoOffset, StaysSmallWhereThereIsNone) {
  for (unsigned seed = 1; seed <= 4; ++seed) {
    Drive drive(0, seed);
    StereoOffset offset;
    for (int i = 0; i < 60; ++i) drive.step(kForward, offset);
    EXPECT_LT(std::abs(offset.pixels()), 0.02) << seed;
  }
}

TEST(StereoOffset, StandingStillTeachesNothing) {
  Drive drive(0.2, 1);
  StereoOffset offset;
  const double before = offset.sigma();
  for (int i = 0; i < 60; ++i) drive.step(SE3(), offset);
  EXPECT_LT(std::abs(offset.pixels()), 0.02);
  EXPECT_GT(offset.sigma(), 0.9 * before);
}

// Sideways motion tells little, since a yaw looks nearly the same. The estimate must be unbiased and within its sigma.
TEST(StereoOffset, SidewaysMotionDoesNoHarm) {
  constexpr unsigned kDrives = 12;
  for (const double truth : {0.0, 0.2}) {
    double sum = 0;
    for (unsigned seed = 1; seed <= kDrives; ++seed) {
      Drive drive(truth, seed);
      StereoOffset offset;
      for (int i = 0; i < 60; ++i) drive.step({Matrix3::Identity(), {0.3, 0, 0}}, offset);
      EXPECT_LT(std::abs(offset.pixels() - truth), 2 * offset.sigma()) << seed;
      sum += offset.pixels();
    }
    EXPECT_GT(sum / kDrives, truth / 2 - 0.025);
    EXPECT_LT(sum / kDrives, truth + 0.025);
  }
}

TEST(StereoOffset, LearnsNothingFromOneEyeOrNoCorrespondences) {
  StereoOffset offset;
  offset.learn({}, kForward, kCarCamera);
  vision::Correspondence mono;
  mono.point = {0, 0, 10};
  mono.pixel = {620, 187, kNoRight};
  const std::vector<vision::Correspondence> all(50, mono);
  offset.learn(all, kForward, kCarCamera);
  EXPECT_EQ(offset.pixels(), 0);
}

}  // namespace
}  // namespace relmap::tracking
