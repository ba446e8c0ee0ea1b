#include "frontend/vision/camera_check.h"

#include <gtest/gtest.h>

#include <random>

#include "frontend/vision/lens.h"
#include "frontend/vision/view_for_test.h"

namespace relmap::vision {
namespace {

using testing_view::kPose;

constexpr StereoCamera kCalibratedRig{640, 319.5, 239.5, 0.2, 640, 480};

// What a rig at kPose really sees of a place: `lens` left of a right eye at `baseline`. One in `wrong` matches is one
// of chance.
struct SeenPlace {
  Lens lens{640, 319.5, 239.5, 0, 0};
  double baseline = 0;  // 0: the left eye alone
  int count = 120;
  double wrong = 0.2;
  double depth_from = 3, depth_to = 15;
  bool wall = false;  // at depth_from, and farther by `slope` for each metre to the right
  double slope = 0;
  double part = 1;    // of the picture's width and height in which anything is seen
  double offset = 0;  // of all disparities, pixels: an eye that is turned a little

  std::vector<Correspondence> make(std::uint64_t seed) const {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> u(10, 630), v(10, 470), depth(depth_from, depth_to), share(0, 1);
    std::normal_distribution<double> noise(0, 0.7);
    std::vector<Correspondence> result;
    while (static_cast<int>(result.size()) < count) {
      const auto direction = lens.undistort({320 + part * (u(random) - 320), 240 + part * (v(random) - 240)});
      if (!direction) continue;
      const double z = wall ? depth_from / (1 - slope * direction->x()) : depth(random);
      const Vector3 p(direction->x() * z, direction->y() * z, z);
      const Vector2 pixel = lens.project(p) + Vector2(noise(random), noise(random));
      const double right = baseline > 0 ? pixel.x() - lens.f * baseline / z - offset + 0.3 * noise(random) : kNoRight;
      result.push_back({kPose * p, {pixel.x(), pixel.y(), right}, 1, 1e-6 * z * z * Matrix3::Identity()});
      if (share(random) < wrong) result.back().pixel.head<2>() = Vector2(u(random), v(random));
    }
    return result;
  }
};

// As the server does: the pose that the named camera finds is checked.
Status check(const std::vector<Correspondence>& seen, const StereoCamera& camera) {
  MotionOptions options;
  options.min_inliers = 15;
  options.max_trials = 1000;
  const auto motion = estimate_motion(seen, camera, options);
  return motion.ok() ? check_camera(seen, camera, motion->T_reference_camera, kCalibratedRig) : motion.status();
}

// In how many of ten scenes check_camera() contradicts the camera.
int contradicted(const SeenPlace& scene, const StereoCamera& camera) {
  int count = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed)
    count += check(scene.make(seed), camera).reason() == Reason::WRONG_CALIBRATION;
  return count;
}

int passed(const SeenPlace& scene, const StereoCamera& camera) {
  int count = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) count += check(scene.make(seed), camera).ok();
  return count;
}

StereoCamera one_eye(StereoCamera camera) {
  camera.baseline = 0;
  return camera;
}

TEST(CameraCheck, StretchedPicturesAreFound) {
  SeenPlace scene;
  for (const double aspect : {0.85, 1.06, 1.17}) {
    scene.lens.aspect = aspect;
    EXPECT_EQ(contradicted(scene, one_eye(kCalibratedRig)), 10) << aspect;
  }
}

TEST(CameraCheck, TheRightCameraPasses) {
  for (const double wrong : {0.0, 0.2, 0.5})
    for (const int count : {60, 120, 400}) {
      SeenPlace scene;
      scene.wrong = wrong;
      scene.count = count;
      EXPECT_EQ(passed(scene, one_eye(kCalibratedRig)), 10) << wrong << ' ' << count;
      scene.baseline = kCalibratedRig.baseline;
      EXPECT_EQ(passed(scene, kCalibratedRig), 10) << wrong << ' ' << count;
    }
}

TEST(CameraCheck, ACameraWithUsualCalibrationErrorsPasses) {
  SeenPlace scene;
  scene.lens.f *= 1.01;
  scene.lens.cx += 2;
  scene.lens.k1 = 0.01;
  EXPECT_EQ(passed(scene, one_eye(kCalibratedRig)), 10);
}

TEST(CameraCheck, AnotherFocalLengthIsFound) {
  for (const double factor : {0.7, 0.9, 1.1, 1.4}) {
    SeenPlace scene;
    scene.lens.f *= factor;
    EXPECT_GE(contradicted(scene, one_eye(kCalibratedRig)), 9) << factor;
    scene.baseline = kCalibratedRig.baseline;
    EXPECT_GE(contradicted(scene, kCalibratedRig), 9) << factor;
  }
  SeenPlace longer;
  longer.lens.f *= 1.1;
  EXPECT_NE(check(longer.make(1), one_eye(kCalibratedRig)).message().find(" % longer"), std::string::npos);
}

TEST(CameraCheck, ALensThatWasNotRectifiedIsFound) {
  SeenPlace raw;
  raw.lens = {640, 325, 236, -0.3, 0.08};
  EXPECT_GE(contradicted(raw, one_eye(kCalibratedRig)), 9);
  const Status found = check(raw.make(1), one_eye(kCalibratedRig));
  EXPECT_NE(found.message().find("before it is rectified"), std::string::npos) << found.message();
}

TEST(CameraCheck, AnotherPrincipalPointIsFound) {
  SeenPlace scene;
  scene.lens.cx += 0.05 * kCalibratedRig.width;
  EXPECT_GE(contradicted(scene, one_eye(kCalibratedRig)), 9);
}

TEST(CameraCheck, AnotherBaselineIsFound) {
  for (const double factor : {0.75, 1.3}) {
    SeenPlace scene;
    scene.baseline = factor * kCalibratedRig.baseline;
    EXPECT_GE(contradicted(scene, kCalibratedRig), 9) << factor;
  }
  SeenPlace longer;
  longer.baseline = 1.5 * kCalibratedRig.baseline;
  EXPECT_NE(check(longer.make(1), kCalibratedRig).message().find("a baseline"), std::string::npos);
}

// A rig as its front-end takes it: an eye is turned by a tenth of a degree.
TEST(CameraCheck, AnOffsetOfAllDisparitiesIsNoBaseline) {
  for (const double offset : {-1.5, 1.5})
    for (const double far : {1.0, 3.0}) {
      SeenPlace scene;
      scene.baseline = kCalibratedRig.baseline;
      scene.offset = offset;
      scene.depth_from *= far;
      scene.depth_to *= far;
      EXPECT_EQ(contradicted(scene, kCalibratedRig), 0) << offset << ' ' << far;
    }
}

// From the front a wall looks the same from near with a wide lens and from far with a long one.
TEST(CameraCheck, ViewsThatCannotTellPass) {
  SeenPlace wall;
  wall.wall = true;
  for (const double slope : {0.0, 0.3})
    for (const double part : {0.5, 1.0})
      for (const int count : {30, 120}) {
        wall.slope = slope;
        wall.part = part;
        wall.count = count;
        wall.baseline = 0;
        EXPECT_EQ(contradicted(wall, one_eye(kCalibratedRig)), 0) << slope << ' ' << part << ' ' << count;
        wall.baseline = kCalibratedRig.baseline;
        EXPECT_EQ(contradicted(wall, kCalibratedRig), 0) << slope << ' ' << part << ' ' << count;
      }
  SeenPlace few;
  few.count = 24;
  few.lens.f *= 1.2;
  EXPECT_EQ(contradicted(few, one_eye(kCalibratedRig)), 0);
  EXPECT_TRUE(check_camera({}, kCalibratedRig, {}, kCalibratedRig).ok());
}

// Correspondences of chance do not contradict a camera.
TEST(CameraCheck, CorrespondencesOfChancePass) {
  SeenPlace chance;
  chance.wrong = 1;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const auto seen = chance.make(seed);
    EXPECT_TRUE(check_camera(seen, one_eye(kCalibratedRig), kPose, kCalibratedRig).ok());
  }
}

}  // namespace
}  // namespace relmap::vision
