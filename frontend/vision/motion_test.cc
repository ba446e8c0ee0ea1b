#include "frontend/vision/motion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "proto/geometry/covariance.h"

namespace relmap::vision {
namespace {

const StereoCamera kStereoCamera{400, 256, 192, 0.12, 512, 384};

struct Scene {
  SE3 truth;
  std::vector<Correspondence> all;
  std::size_t outliers = 0;
};

// `mono_share` of the measurements have no right eye; the first `outlier_share` of them are wrong.
Scene make_scene(unsigned seed, std::size_t count, double outlier_share, double mono_share, double noise) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  std::normal_distribution<double> gauss(0, 1);
  Scene scene;
  Vector6 xi;
  xi << 0.1 * gauss(random), 0.05 * gauss(random), 0.4 + 0.1 * gauss(random), 0.03 * gauss(random),
      0.05 * gauss(random), 0.03 * gauss(random);
  scene.truth = SE3::exp(xi);
  scene.outliers = static_cast<std::size_t>(outlier_share * static_cast<double>(count));
  while (scene.all.size() < count) {
    const double depth = 1.5 * std::pow(10.0, unit(random));
    const Vector3 seen{(unit(random) * 512 - 256) / 400 * depth, (unit(random) * 384 - 192) / 400 * depth, depth};
    Correspondence c;
    c.point = scene.truth * seen;
    c.pixel = kStereoCamera.project(seen) + noise * Vector3(gauss(random), gauss(random), gauss(random));
    c.sigma = std::max(noise, 1e-3);
    if (scene.all.size() < scene.outliers) {
      c.pixel.x() = unit(random) * 512;
      c.pixel.y() = unit(random) * 384;
      c.pixel.z() = c.pixel.x() - 30 * unit(random);
    }
    if (unit(random) < mono_share) c.pixel.z() = kNoRight;
    scene.all.push_back(c);
  }
  return scene;
}

double chi2(const Scene& scene, const Motion& motion) {
  const Vector6 error = (motion.T_reference_camera.inverse() * scene.truth).log();
  return mahalanobis_squared(error, motion.covariance);
}

TEST(Motion, IsExactWithoutNoise) {
  for (const double mono : {0.0, 0.5, 1.0}) {
    const Scene scene = make_scene(1, 80, 0, mono, 0);
    const auto motion = estimate_motion(scene.all, kStereoCamera);
    ASSERT_TRUE(motion.ok()) << motion.status().to_string();
    EXPECT_LT((motion->T_reference_camera.inverse() * scene.truth).log().norm(), 1e-6) << "mono share " << mono;
    EXPECT_EQ(motion->inliers.size(), scene.all.size());
    EXPECT_LT(motion->rms_px, 1e-4);
  }
}

// With few uncertain points, the inliers may change while the pose is refined.
TEST(Motion, InliersAreCountedAfterTheRefinement) {
  for (unsigned seed = 1; seed <= 300; ++seed) {
    Scene scene = make_scene(seed, 36, 0.35, 0.3, 1);
    std::mt19937_64 random(seed);
    std::normal_distribution<double> gauss(0, 1);
    for (Correspondence& c : scene.all) {
      const double sigma = 0.03 * c.point.squaredNorm();
      const Vector3 ray = c.point.normalized();
      c.point_covariance = sigma * sigma * ray * ray.transpose() + 1e-6 * Matrix3::Identity();
      c.point += sigma * gauss(random) * ray;
    }
    MotionOptions options;
    options.min_inliers = 3;
    const auto found = estimate_motion(scene.all, kStereoCamera, options);
    ASSERT_TRUE(found.ok());
    options.min_inliers = static_cast<int>(found->inliers.size());
    const auto demanded = estimate_motion(scene.all, kStereoCamera, options);
    EXPECT_TRUE(demanded.ok()) << "seed " << seed << ": " << demanded.status().to_string();
  }
}

TEST(Motion, ToleratesHalfOutliers) {
  for (const double mono : {0.0, 0.5, 1.0})
    for (unsigned seed = 1; seed <= 20; ++seed) {
      const Scene scene = make_scene(seed, 150, 0.5, mono, 0.5);
      const auto motion = estimate_motion(scene.all, kStereoCamera);
      ASSERT_TRUE(motion.ok()) << motion.status().to_string();
      const Vector6 error = (motion->T_reference_camera.inverse() * scene.truth).log();
      EXPECT_LT(error.head<3>().norm(), 0.05) << "seed " << seed << " mono share " << mono;
      EXPECT_LT(error.tail<3>().norm(), 0.01) << "seed " << seed << " mono share " << mono;
      const auto right = static_cast<std::size_t>(
          std::count_if(motion->inliers.begin(), motion->inliers.end(), [&](auto i) { return i >= scene.outliers; }));
      EXPECT_GE(right, 70u);
      EXPECT_LE(motion->inliers.size() - right, 4u);
      EXPECT_NEAR(motion->rms_px, 0.5, 0.15);
    }
}

TEST(Motion, CovarianceAgreesWithTheErrors) {
  double sum = 0;
  constexpr int kRuns = 60;
  for (unsigned seed = 100; seed < 100 + kRuns; ++seed) {
    const Scene scene = make_scene(seed, 120, 0.2, 0.3, 1.0);
    const auto motion = estimate_motion(scene.all, kStereoCamera);
    ASSERT_TRUE(motion.ok());
    sum += chi2(scene, *motion);
  }
  // 6 expected; Huber's weights lose a little.
  EXPECT_GT(sum / kRuns, 4.0);
  EXPECT_LT(sum / kRuns, 8.5);
}

TEST(Motion, UncertainPointsWidenTheGateAndTheCovariance) {
  Scene scene = make_scene(7, 100, 0, 0, 0.3);
  std::mt19937_64 random(8);
  std::normal_distribution<double> gauss(0, 1);
  for (Correspondence& c : scene.all) {
    const double sigma = 0.02 * c.point.norm();
    c.point += sigma * Vector3(gauss(random), gauss(random), gauss(random));
    c.point_covariance = sigma * sigma * Matrix3::Identity();
  }
  const auto motion = estimate_motion(scene.all, kStereoCamera);
  ASSERT_TRUE(motion.ok());
  EXPECT_GT(motion->inliers.size(), 90u);
  EXPECT_LT(chi2(scene, *motion), 22.5);  // chi2_6(0.999)
  std::vector<Correspondence> exact = scene.all;
  for (Correspondence& c : exact) c.point_covariance.setZero();
  const auto narrow = estimate_motion(exact, kStereoCamera);
  ASSERT_FALSE(narrow.ok() && narrow->inliers.size() > 60);
}

TEST(Motion, APointOfUnboundedUncertaintyIsNoInlier) {
  Scene scene = make_scene(4, 80, 0, 0, 0.3);
  Correspondence before_the_eye = scene.all.front();
  before_the_eye.point = scene.truth * Vector3(-0.002, 0.003, 0.0011);
  before_the_eye.point_covariance = 0.01 * Matrix3::Identity();
  scene.all.push_back(before_the_eye);
  const auto motion = estimate_motion(scene.all, kStereoCamera);
  ASSERT_TRUE(motion.ok()) << motion.status().to_string();
  EXPECT_EQ(motion->inliers.size(), 80u);
  EXPECT_LT(motion->inliers.back(), 80u);
}

// Thirty points of a wall whose distance is hardly known agree with many poses; twenty that are known to a pixel agree
// with one. (Without their weights, some closures of a flight were metres off.)
TEST(Motion, FewCertainPointsOutweighManyUncertainOnes) {
  int right = 0;
  for (unsigned seed = 1; seed <= 50; ++seed) {
    Scene scene = make_scene(seed, 20, 0, 0.3, 0.5);
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    std::normal_distribution<double> gauss(0, 1);
    const SE3 T_elsewhere = scene.truth * SE3{so3_exp({0, 0.1, 0}), {1.5, 0, 0}};
    for (int i = 0; i < 30; ++i) {
      const double depth = 5 + unit(random);
      const Vector3 seen{(unit(random) * 512 - 256) / 400 * depth, (unit(random) * 384 - 192) / 400 * depth, depth};
      Correspondence c;
      c.point = T_elsewhere * seen + 0.2 * Vector3(gauss(random), gauss(random), gauss(random));
      c.point_covariance = 0.2 * 0.2 * Matrix3::Identity();
      c.pixel = kStereoCamera.project(seen);
      c.sigma = 0.5;
      scene.all.push_back(c);
    }
    MotionOptions options;
    options.seed = seed;
    const auto motion = estimate_motion(scene.all, kStereoCamera, options);
    ASSERT_TRUE(motion.ok()) << motion.status().to_string();
    right += (motion->T_reference_camera.t - scene.truth.t).norm() < 0.1;
  }
  EXPECT_GE(right, 35) << "of 50; by numbers alone none is";
}

TEST(Motion, SameSeedSameAnswer) {
  const Scene scene = make_scene(3, 150, 0.4, 0.3, 0.7);
  const auto a = estimate_motion(scene.all, kStereoCamera), b = estimate_motion(scene.all, kStereoCamera);
  ASSERT_TRUE(a.ok() && b.ok());
  EXPECT_EQ(a->inliers, b->inliers);
  EXPECT_EQ(a->T_reference_camera.t, b->T_reference_camera.t);
  EXPECT_EQ(a->covariance, b->covariance);
}

TEST(Motion, AGoodGuessNeedsNoTrials) {
  const Scene scene = make_scene(4, 150, 0.3, 0.5, 0.5);
  MotionOptions none;
  none.max_trials = 0;
  EXPECT_EQ(estimate_motion(scene.all, kStereoCamera, none).reason(), Reason::TOO_FEW_INLIERS);
  Vector6 off;
  off << 0.02, -0.01, 0.03, 0.004, -0.004, 0.002;
  const SE3 guess = scene.truth * SE3::exp(off);
  const auto motion = estimate_motion(scene.all, kStereoCamera, none, &guess);
  ASSERT_TRUE(motion.ok());
  EXPECT_LT((motion->T_reference_camera.inverse() * scene.truth).log().norm(), 0.05);
}

TEST(Motion, AGuessWithEnoughInliersIsTakenWithoutTrials) {
  MotionOptions no_trials;
  no_trials.max_trials = 0;
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const Scene scene = make_scene(seed, 150, 0.2, 0.3, 0.5);
    Vector6 off;
    off << 0.004, -0.002, 0.006, 0.0006, -0.0006, 0.0003;
    const SE3 guess = scene.truth * SE3::exp(off);
    // The same as without trials: none were drawn.
    const auto taken = estimate_motion(scene.all, kStereoCamera, {}, &guess);
    const auto bare = estimate_motion(scene.all, kStereoCamera, no_trials, &guess);
    ASSERT_TRUE(taken.ok() && bare.ok()) << seed;
    EXPECT_EQ(taken->T_reference_camera.t, bare->T_reference_camera.t) << seed;
    EXPECT_EQ(taken->inliers, bare->inliers) << seed;
    EXPECT_LT((taken->T_reference_camera.inverse() * scene.truth).log().norm(), 0.05) << seed;
  }
}

TEST(Motion, AGuessWithFewInliersIsNot) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const Scene scene = make_scene(seed, 150, 0.2, 0.3, 0.5);
    Vector6 off;
    off << 0.5, 0.2, -0.5, 0.05, -0.1, 0.05;
    const SE3 guess = scene.truth * SE3::exp(off);
    const auto motion = estimate_motion(scene.all, kStereoCamera, {}, &guess);
    ASSERT_TRUE(motion.ok()) << seed;
    EXPECT_LT((motion->T_reference_camera.inverse() * scene.truth).log().norm(), 0.05) << seed;
  }
}

// 70 % are wrong, most of them in the second half, so sampling from the first ones needs few trials.
TEST(Motion, OrderedCorrespondencesNeedFewTrials) {
  constexpr unsigned kScenes = 30;
  const auto found = [](bool in_order, int trials) {
    int right = 0;
    for (unsigned seed = 1; seed <= kScenes; ++seed) {
      const Scene scene = make_scene(seed, 200, 0.7, 0.3, 0.5);
      // make_scene puts the wrong ones first. Now, of the first half three in five are right, of the rest none.
      std::vector<Correspondence> ordered(scene.all.begin() + 100, scene.all.end());
      std::mt19937 random(seed);
      std::shuffle(ordered.begin(), ordered.end(), random);
      ordered.insert(ordered.end(), scene.all.begin(), scene.all.begin() + 100);
      MotionOptions options;
      options.seed = seed;
      options.max_trials = trials;
      options.ordered = in_order;
      const auto motion = estimate_motion(ordered, kStereoCamera, options);
      right += motion.ok() && (motion->T_reference_camera.inverse() * scene.truth).log().norm() < 0.1;
    }
    return right;
  };
  EXPECT_EQ(found(true, 60), static_cast<int>(kScenes));
  EXPECT_GE(found(true, 20), 27);
  EXPECT_LE(found(false, 20), 15);
}

TEST(Motion, RefusesWhatDoesNotAgree) {
  EXPECT_EQ(estimate_motion({}, kStereoCamera).reason(), Reason::TOO_FEW_INLIERS);
  Scene scene = make_scene(5, 60, 1.0, 0.5, 0.5);
  EXPECT_EQ(estimate_motion(scene.all, kStereoCamera).reason(), Reason::TOO_FEW_INLIERS);
  // All points in one: any rotation about it fits.
  for (Correspondence& c : scene.all) c = scene.all.front();
  EXPECT_EQ(estimate_motion(scene.all, kStereoCamera).reason(), Reason::TOO_FEW_INLIERS);
}

TEST(Motion, LeavesOutWhatIsNotFinite) {
  Scene scene = make_scene(6, 60, 0, 0, 0.5);
  scene.all[10].point.x() = std::numeric_limits<double>::quiet_NaN();
  scene.all[20].pixel.x() = std::numeric_limits<double>::infinity();
  scene.all[30].sigma = 0;
  const auto motion = estimate_motion(scene.all, kStereoCamera);
  ASSERT_TRUE(motion.ok());
  EXPECT_GE(motion->inliers.size(), 50u);
  for (const auto bad : {10u, 20u, 30u}) EXPECT_EQ(std::count(motion->inliers.begin(), motion->inliers.end(), bad), 0);
}

}  // namespace
}  // namespace relmap::vision
