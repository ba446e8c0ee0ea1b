#include "proto/geometry/camera.h"

#include <gtest/gtest.h>

namespace relmap {
namespace {

const StereoCamera kCamera{400, 256, 192, 0.12, 512, 384};

TEST(StereoCamera, TriangulatesWhatItProjects) {
  for (const Vector3& p : {Vector3(0, 0, 2), Vector3(-1, 0.5, 4), Vector3(3, -2, 60)})
    EXPECT_LT((kCamera.triangulate(kCamera.project(p)) - p).norm(), 1e-9);
}

TEST(StereoCamera, DisparityIsFocalLengthTimesBaselineOverDepth) {
  const StereoPixel z = kCamera.project({0, 0, 4});
  EXPECT_DOUBLE_EQ(z.x(), 256);
  EXPECT_DOUBLE_EQ(z.x() - z.z(), 400 * 0.12 / 4);
}

TEST(StereoCamera, JacobianIsThatOfFiniteDifferences) {
  const Vector3 p(0.7, -0.4, 3);
  for (int k = 0; k < 3; ++k) {
    const Vector3 step = 1e-6 * Vector3::Unit(k);
    const Vector3 difference = (kCamera.project(p + step) - kCamera.project(p - step)) / 2e-6;
    EXPECT_LT((kCamera.jacobian(p).col(k) - difference).norm(), 1e-6);
  }
}

TEST(StereoCamera, PictureReachesHalfAPixelBeyondItsPixelCentres) {
  EXPECT_TRUE(kCamera.in_picture(-0.5, 383.5));
  EXPECT_FALSE(kCamera.in_picture(-0.6, 0));
  EXPECT_FALSE(kCamera.in_picture(0, 383.6));
}

TEST(StereoCamera, ImplausibleOnesAreRefused) {
  EXPECT_TRUE(kCamera.check_plausible().ok());
  StereoCamera mono = kCamera;
  mono.baseline = 0;
  EXPECT_TRUE(mono.check_plausible().ok());
  for (double StereoCamera::*field : {&StereoCamera::f, &StereoCamera::cx, &StereoCamera::cy, &StereoCamera::baseline})
    for (const double value :
         {-1.0, 1e9, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
      StereoCamera camera = kCamera;
      camera.*field = value;
      EXPECT_EQ(camera.check_plausible().reason(), Reason::IMPLAUSIBLE_CALIBRATION) << value;
    }
  for (int StereoCamera::*field : {&StereoCamera::width, &StereoCamera::height})
    for (const int value : {-1, 0, 15, 16385}) {
      StereoCamera camera = kCamera;
      camera.*field = value;
      EXPECT_EQ(camera.check_plausible().reason(), Reason::IMPLAUSIBLE_CALIBRATION) << value;
    }
}

}  // namespace
}  // namespace relmap
