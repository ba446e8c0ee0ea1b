#include "frontend/vision/tolerant_motion.h"

#include <gtest/gtest.h>

#include <random>

#include "frontend/vision/lens.h"
#include "frontend/vision/view_for_test.h"
#include "proto/geometry/covariance.h"

namespace relmap::vision {
namespace {

using testing_view::kMonoCamera;
using testing_view::kPose;

constexpr StereoCamera kMapCamera{640, 319.5, 239.5, 0.5, 640, 480};

std::vector<Correspondence> seen_by(const Lens& lens, std::uint64_t seed, int count = 120) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> u(10, 630), v(10, 470), depth(3, 25);
  std::normal_distribution<double> noise(0, 1);
  std::vector<Correspondence> seen;
  for (int i = 0; i < count; ++i) {
    const double z = depth(random);
    const Vector3 p = z * Vector3((u(random) - 320) / 640, (v(random) - 240) / 640, 1);
    const Vector2 pixel = lens.project(p) + Vector2(noise(random), noise(random));
    seen.push_back({kPose * p, {pixel.x(), pixel.y(), kNoRight}, 1, Matrix3::Zero()});
  }
  return seen;
}

struct Errors {
  double nees = 0, metres = 0, sigma = 0;  // means
  int count = 0;

  void add(const Motion& motion) {
    const Vector6 error = (kPose.inverse() * motion.T_reference_camera).log();
    nees += mahalanobis_squared(error, motion.covariance);
    metres += (motion.T_reference_camera.t - kPose.t).norm();
    sigma += std::sqrt(motion.covariance.topLeftCorner<3, 3>().trace());
    ++count;
  }
  Errors mean() const { return {nees / count, metres / count, sigma / count, count}; }
};

// Mean errors over lenses that differ from the named one as calibrations do, or only by `log_f` in the focal length.
struct Both {
  Errors exact, tolerant;
};
Both errors(std::optional<double> log_f) {
  Both sum;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    std::mt19937_64 random(1000 + seed);
    std::normal_distribution<double> normal;
    Lens lens{kMonoCamera.f, kMonoCamera.cx, kMonoCamera.cy, 0, 0};
    lens.f *= std::exp(log_f.value_or(0.015 * normal(random)));
    if (!log_f) {
      lens.cx += 3.2 * normal(random);
      lens.cy += 3.2 * normal(random);
    }
    const auto seen = seen_by(lens, seed);
    const auto exact = estimate_motion(seen, kMonoCamera);
    if (!exact.ok()) continue;
    const auto tolerant = estimate_tolerant_motion(seen, kMonoCamera, kMapCamera, exact->T_reference_camera);
    if (!tolerant.ok()) continue;
    sum.exact.add(*exact);
    sum.tolerant.add(*tolerant);
  }
  return {sum.exact.mean(), sum.tolerant.mean()};
}

TEST(TolerantMotion, ItsCovarianceCoversUsualCalibrationErrors) {
  const Both both = errors(std::nullopt);
  EXPECT_EQ(both.tolerant.count, 40);
  EXPECT_GT(both.exact.nees, 30) << "taken as exact";
  EXPECT_LT(both.tolerant.nees, 9) << "six degrees of freedom";
  EXPECT_GT(both.tolerant.nees, 1);
  EXPECT_LT(both.tolerant.metres, 0.6 * both.exact.metres);
}

TEST(TolerantMotion, AFocalLengthThatIsSlightlyOffIsCorrectedAndInTheCovariance) {
  for (const double log_f : {-0.03, -0.02, 0.02, 0.03}) {
    const Both both = errors(log_f);
    EXPECT_GT(both.exact.metres, 3 * both.exact.sigma) << log_f;
    EXPECT_LT(both.tolerant.metres, 2 * both.tolerant.sigma) << log_f;
    EXPECT_LT(both.tolerant.metres, 0.5 * both.exact.metres) << log_f;
  }
}

TEST(TolerantMotion, IndicesAreThoseOfTheCaller) {
  auto seen = seen_by({kMonoCamera.f, kMonoCamera.cx, kMonoCamera.cy, 0, 0}, 7);
  seen[3].sigma = 0;         // of no use
  seen[5].pixel.x() += 100;  // an outlier
  const auto motion = estimate_tolerant_motion(seen, kMonoCamera, kMapCamera, kPose);
  ASSERT_TRUE(motion.ok());
  EXPECT_GT(motion->inliers.size(), 100u);
  for (const std::uint32_t i : motion->inliers) EXPECT_TRUE(i != 3 && i != 5);
  EXPECT_LT(motion->rms_px, 1.3);
}

TEST(TolerantMotion, TooFewAreRefused) {
  auto seen = seen_by({kMonoCamera.f, kMonoCamera.cx, kMonoCamera.cy, 0, 0}, 7, 8);
  EXPECT_EQ(estimate_tolerant_motion(seen, kMonoCamera, kMapCamera, kPose).reason(), Reason::TOO_FEW_INLIERS);
}

}  // namespace
}  // namespace relmap::vision
