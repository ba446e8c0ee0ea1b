#include "frontend/vision/unknown_lens.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "frontend/vision/view_for_test.h"
#include "proto/geometry/covariance.h"

namespace relmap::vision {
namespace {

using testing_view::kMonoCamera;
using testing_view::kPose;

// What a camera at kPose sees; `wrong` of them anywhere in the picture.
std::vector<Correspondence> scene(std::uint64_t seed, const Lens& lens, int count, int wrong, double noise,
                                  double depth_from = 3, double depth_to = 15) {
  std::mt19937_64 random(seed);
  const double reach_x = 0.49 * kMonoCamera.width / lens.f, reach_y = 0.49 * kMonoCamera.height / lens.f;
  std::uniform_real_distribution<double> x(-1.3 * reach_x, 1.3 * reach_x), y(-1.3 * reach_y, 1.3 * reach_y);
  std::uniform_real_distribution<double> u(20, 620), v(20, 460), depth(depth_from, depth_to);
  std::normal_distribution<double> normal(0, noise);
  std::vector<Correspondence> result;
  while (static_cast<int>(result.size()) < count) {
    const double z = depth(random);
    const Vector3 in_camera(x(random) * z, y(random) * z, z);
    const Vector2 pixel = lens.project(in_camera);
    if (!kMonoCamera.in_picture(pixel.x(), pixel.y())) continue;
    result.push_back({kPose * in_camera, {pixel.x() + normal(random), pixel.y() + normal(random), kNoRight}, 1});
  }
  for (int i = 0; i < wrong; ++i) result[static_cast<std::size_t>(i)].pixel = {u(random), v(random), kNoRight};
  return result;
}

Lens plain(double f) { return {f, 319.5, 239.5, 0, 0}; }

double nees_of(const MotionAndLens& found) {
  const Vector6 error = (kPose.inverse() * found.motion.T_reference_camera).log();
  return mahalanobis_squared(error, found.motion.covariance);
}

MotionOptions options() {
  MotionOptions options;
  options.min_inliers = 20;
  return options;
}

TEST(UnknownLens, IsFoundWithThePoseAmongWrongMatches) {
  for (const double f : {350.0, 640.0, 1100.0, 1900.0}) {
    const auto found = estimate_motion_and_lens(scene(1, plain(f), 150, 60, 0.5), kMonoCamera, options());
    ASSERT_TRUE(found.ok()) << f << ": " << found.status().to_string();
    EXPECT_NEAR(found->lens.f / f, 1, 0.03);
    EXPECT_LT(std::abs(std::log(found->lens.f / f)), 4 * found->sigma_log_f + 1e-3);
    EXPECT_GE(found->motion.inliers.size(), 80u);
    EXPECT_LT((kPose.inverse() * found->motion.T_reference_camera).t.norm(), 0.3) << f;
  }
}

TEST(UnknownLens, TheCovarianceIncludesTheUncertaintyOfTheLens) {
  double nees = 0;
  constexpr int kTrials = 30;
  for (int i = 0; i < kTrials; ++i) {
    const auto found = estimate_motion_and_lens(scene(100 + static_cast<std::uint64_t>(i), plain(700), 80, 0, 1),
                                                kMonoCamera, options());
    ASSERT_TRUE(found.ok()) << found.status().to_string();
    nees += nees_of(*found) / kTrials;
  }
  EXPECT_GT(nees, 4.0);
  EXPECT_LT(nees, 8.5);
}

// Lenses as cameras have them: from a strong barrel (a robot's wide lens, of which the picture's corners are 70 pixels
// off) to a slight pincushion. A test each, for sanitizers make them long.
class UnknownLensOf : public testing::TestWithParam<Lens> {};

TEST_P(UnknownLensOf, DistortionIsFoundOrInTheCovariance) {
  double nees = 0, square_metres = 0;
  constexpr int kTrials = 15;
  for (int i = 0; i < kTrials; ++i) {
    const auto found = estimate_motion_and_lens(scene(300 + static_cast<std::uint64_t>(i), GetParam(), 120, 40, 1),
                                                kMonoCamera, options());
    ASSERT_TRUE(found.ok()) << found.status().to_string();
    EXPECT_GE(found->motion.inliers.size(), 60U);
    nees += nees_of(*found) / kTrials;
    square_metres += (kPose.inverse() * found->motion.T_reference_camera).t.squaredNorm() / kTrials;
  }
  EXPECT_LT(nees, 9);
  EXPECT_GT(nees, 2);
  EXPECT_LT(std::sqrt(square_metres), 0.25);
}

INSTANTIATE_TEST_SUITE_P(Lenses, UnknownLensOf,
                         testing::Values(Lens{460, 312, 247, -0.28, 0.07}, Lens{460, 319.5, 239.5, -0.15, 0.02},
                                         Lens{700, 326, 236, -0.1, 0}, Lens{900, 315, 243, 0.06, 0}),
                         [](const auto& test) { return std::string(1, static_cast<char>('A' + test.index)); });

TEST(UnknownLens, UndistortingIsTheInverseOfProjecting) {
  for (const Lens& lens : {Lens{460, 312, 247, -0.28, 0.07, 0.8}, Lens{900, 315, 243, 0.06, 0}})
    for (const Vector3& p : {Vector3(0.4, -0.3, 2), Vector3(-2.5, 1.1, 4), Vector3(0, 0, 1)}) {
      const auto x = lens.undistort(lens.project(p));
      ASSERT_TRUE(x.has_value());
      EXPECT_LT((*x - p.head<2>() / p.z()).norm(), 1e-9);
    }
  EXPECT_FALSE((Lens{460, 312, 247, -0.28, 0}.undistort({1500, 1200})).has_value()) << "beyond what it can see";
}

TEST(UnknownLens, JacobiansAgreeWithDifferences) {
  const Lens lens{460, 312, 247, -0.28, 0.07, 1.1};
  for (const Vector3& p : {Vector3(0.4, -0.3, 2), Vector3(-2.5, 1.1, 4), Vector3(0, 0, 1)}) {
    constexpr double kStep = 1e-6;
    for (int k = 0; k < 3; ++k) {
      const Vector3 step = kStep * Vector3::Unit(k);
      const Vector2 difference = (lens.project(p + step) - lens.project(p - step)) / (2 * kStep);
      EXPECT_LT((difference - lens.jacobian(p).col(k)).norm(), 1e-5 * lens.f) << k;
    }
    for (int k = 0; k < Lens::kParameters; ++k) {
      const auto step = (kStep * Eigen::Matrix<double, Lens::kParameters, 1>::Unit(k)).eval();
      const Vector2 difference = (lens.plus(step).project(p) - lens.plus(-step).project(p)) / (2 * kStep);
      EXPECT_LT((difference - lens.lens_jacobian(p).col(k)).norm(), 1e-5 * lens.f) << k;
    }
  }
}

// Of ten pictures: how many are answered, and why the others are not.
struct Answers {
  int given = 0;
  std::vector<std::string> refusals;  // NO_CALIBRATION

  auto named(const std::string& what) const {
    return std::count_if(refusals.begin(), refusals.end(),
                         [&](const std::string& refusal) { return refusal.find(what) != std::string::npos; });
  }
};
Answers answers(const Lens& lens) {
  Answers answers;
  constexpr std::size_t kAsked = 40;  // by the server
  for (std::uint64_t seed = 500; seed < 510; ++seed) {
    const auto found = estimate_motion_and_lens(scene(seed, lens, 120, 40, 1), kMonoCamera, options());
    answers.given += found.ok() && found->motion.inliers.size() >= kAsked;
    if (found.reason() == Reason::NO_CALIBRATION) answers.refusals.push_back(found.status().message());
  }
  return answers;
}

TEST(UnknownLens, AStretchedPictureIsRefused) {
  for (const double aspect : {0.85, 0.94, 1.06, 1.17}) {
    const Answers stretched = answers({700, 319.5, 239.5, 0, 0, aspect});
    EXPECT_EQ(stretched.given, 0) << aspect;
    // Where a usual lens fits it elsewhere; further off too few agree.
    if (std::abs(aspect - 1) > 0.1) continue;
    EXPECT_GE(stretched.named(aspect > 1 ? "stretched in height by " : "stretched in width by "), 5) << aspect;
    EXPECT_GE(stretched.named("by 6"), 1) << aspect;
  }
  EXPECT_EQ(answers({460, 319.5, 239.5, -0.28, 0.07, 1.17}).given, 0);
}

TEST(UnknownLens, ACroppedPictureIsRefused) {
  for (const Lens& lens : {Lens{460, 213, 239.5, -0.28, 0.07}, Lens{700, 319.5, 350}}) {
    const Answers part = answers(lens);
    EXPECT_EQ(part.given, 0) << lens.f;
    EXPECT_GE(part.named("part of a larger one"), 5) << lens.f;
  }
  // From a corner, and with more gone at one side: the fit begins far away.
  for (const Lens& lens : {Lens{700, 180, 180}, Lens{460, 180, 180, -0.28, 0.07}, Lens{460, 319.5, 350, -0.28, 0.07}})
    EXPECT_EQ(answers(lens).given, 0) << lens.f << ' ' << lens.cx;
}

TEST(UnknownLens, UneditedPicturesAreAnswered) {
  for (const Lens& lens :
       {Lens{460, 312, 247, -0.28, 0.07}, Lens{700, 330, 230, 0, 0, 1.004}, Lens{1900, 319.5, 239.5}})
    EXPECT_EQ(answers(lens).given, 10) << lens.f;
}

TEST(UnknownLens, CannotBeToldFromAWallSeenFromTheFront) {
  const auto found = estimate_motion_and_lens(scene(3, plain(700), 100, 0, 1, 8, 8.0001), kMonoCamera, options());
  EXPECT_EQ(found.reason(), Reason::NO_CALIBRATION) << found.status().to_string();
}

TEST(UnknownLens, CorrespondencesOfChanceAreRefused) {
  EXPECT_EQ(estimate_motion_and_lens(scene(4, plain(700), 120, 120, 1), kMonoCamera, options()).reason(),
            Reason::TOO_FEW_INLIERS);
  EXPECT_EQ(estimate_motion_and_lens({}, kMonoCamera, options()).reason(), Reason::TOO_FEW_INLIERS);
}

TEST(UnknownLens, TheSameInputGivesTheSameAnswer) {
  const auto points = scene(5, plain(800), 100, 30, 1);
  const auto a = estimate_motion_and_lens(points, kMonoCamera, options());
  const auto b = estimate_motion_and_lens(points, kMonoCamera, options());
  ASSERT_TRUE(a.ok() && b.ok());
  EXPECT_EQ(a->lens.f, b->lens.f);
  EXPECT_EQ(a->motion.T_reference_camera.t, b->motion.T_reference_camera.t);
}

}  // namespace
}  // namespace relmap::vision
