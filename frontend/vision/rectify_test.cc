#include "frontend/vision/rectify.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "frontend/vision/textures_for_test.h"

namespace relmap::vision {
namespace {

using testing_textures::paint;

constexpr int kRawWidth = 640, kRawHeight = 480;

StereoCalibration rig() {
  StereoCalibration c;
  c.left = {460, 458, 320, 242, -0.28, 0.07, 0.0002, -0.0001, 0};
  c.right = {455, 456, 327, 236, -0.27, 0.06, -0.0001, 0.0002, 0};
  c.T_right_left = SE3{so3_exp({0.01, -0.015, 0.008}), {-0.11, 0.002, -0.001}};
  c.width = kRawWidth;
  c.height = kRawHeight;
  return c;
}

Vector2 project(const RawCamera& c, const Vector3& p) {
  const double x = p.x() / p.z(), y = p.y() / p.z(), r2 = x * x + y * y;
  const double g = 1 + c.k1 * r2 + c.k2 * r2 * r2 + c.k3 * r2 * r2 * r2;
  return {c.fx * (g * x + 2 * c.p1 * x * y + c.p2 * (r2 + 2 * x * x)) + c.cx,
          c.fy * (g * y + c.p1 * (r2 + 2 * y * y) + 2 * c.p2 * x * y) + c.cy};
}

Image blob(const Vector2& at) {
  return paint(kRawWidth, kRawHeight, [&](int x, int y) {
    return 20 + 200 * std::exp(-((x - at.x()) * (x - at.x()) + (y - at.y()) * (y - at.y())) / 18);
  });
}

Vector2 centre(const Image& image) {
  double sum = 0;
  Vector2 mean = Vector2::Zero();
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x)
      if (image.at(x, y) > 30) {
        const double w = image.at(x, y) - 20;
        mean += w * Vector2(x, y);
        sum += w;
      }
  return mean / sum;
}

TEST(Rectifier, PutsPointsWhereTheRectifiedCameraSeesThem) {
  const StereoCalibration calibration = rig();
  const auto rectifier = Rectifier::make(calibration, kRawWidth, kRawHeight);
  ASSERT_TRUE(rectifier.ok()) << rectifier.status().to_string();
  EXPECT_FALSE(rectifier->passes_through());
  EXPECT_NEAR(rectifier->camera().baseline, calibration.T_right_left.t.norm(), 1e-9);
  for (const Vector3& p : {Vector3(0, 0, 2), Vector3(0.5, -0.3, 2), Vector3(-0.8, 0.4, 3), Vector3(1.0, 0.6, 4)}) {
    const auto left = rectifier->left(blob(project(calibration.left, p)));
    const auto right = rectifier->right(blob(project(calibration.right, calibration.T_right_left * p)));
    ASSERT_TRUE(left.ok() && right.ok());
    const StereoPixel expected = rectifier->camera().project(rectifier->left_rotation() * p);
    const Vector2 l = centre(*left), r = centre(*right);
    EXPECT_NEAR(l.x(), expected.x(), 0.1);
    EXPECT_NEAR(l.y(), expected.y(), 0.1);
    EXPECT_NEAR(r.x(), expected.z(), 0.1);
    EXPECT_NEAR(r.y(), expected.y(), 0.1);
  }
}

// A direction that both eyes see alike after rectification is turned so where the right eye's picture is rectified as
// the left one's.
TEST(Rectifier, TellsHowMuchThePictureOfTheOtherEyeIsTurned) {
  const StereoCalibration calibration = rig();
  const auto rectifier = Rectifier::make(calibration, kRawWidth, kRawHeight);
  ASSERT_TRUE(rectifier.ok()) << rectifier.status().to_string();
  const StereoCamera& camera = rectifier->camera();
  EXPECT_GT(rectifier->eye_turn().norm(), 0.01);
  for (const Vector3& direction : {Vector3(0, 0, 1), Vector3(0.3, -0.2, 1), Vector3(-0.4, 0.3, 1)}) {
    const Vector3 far = rectifier->left_rotation().transpose() * (1000 * direction);
    const auto taken_for_left = rectifier->left(blob(project(calibration.right, calibration.T_right_left * far)));
    ASSERT_TRUE(taken_for_left.ok());
    const Vector3 turned = so3_exp(rectifier->eye_turn()) * direction;
    const StereoPixel expected = camera.project(turned);
    EXPECT_NEAR(centre(*taken_for_left).x(), expected.x(), 2) << "the lenses differ, too";
    EXPECT_NEAR(centre(*taken_for_left).y(), expected.y(), 2);
  }
}

TEST(Rectifier, PassesRectifiedPicturesThrough) {
  StereoCalibration calibration;
  calibration.left = calibration.right = {700, 700, 320, 240};
  calibration.T_right_left.t = {-0.5, 0, 0};
  calibration.rectified = true;  // and without a size, as KITTI's are
  const auto rectifier = Rectifier::make(calibration, kRawWidth, kRawHeight);
  ASSERT_TRUE(rectifier.ok()) << rectifier.status().to_string();
  EXPECT_TRUE(rectifier->passes_through());
  EXPECT_TRUE(rectifier->eye_turn().isZero());
  EXPECT_EQ(rectifier->camera(), (StereoCamera{700, 320, 240, 0.5, kRawWidth, kRawHeight}));
  const Image picture = blob({100, 100});
  const auto same = rectifier->right(picture);
  ASSERT_TRUE(same.ok());
  EXPECT_TRUE(std::equal(picture.row(0), picture.row(0) + kRawWidth * kRawHeight, same->row(0)));
}

TEST(Rectifier, WritesIntoTheMemoryGiven) {
  StereoCalibration parallel = rig();
  parallel.left = parallel.right = {700, 700, 320, 240};
  parallel.T_right_left = SE3{Matrix3::Identity(), {-0.5, 0, 0}};
  parallel.rectified = true;
  for (const StereoCalibration& calibration : {rig(), parallel}) {
    const auto rectifier = Rectifier::make(calibration, kRawWidth, kRawHeight);
    ASSERT_TRUE(rectifier.ok()) << rectifier.status().to_string();
    Image out;
    for (const Vector2& at : {Vector2(100, 100), Vector2(400, 300)}) {
      const Image picture = blob(at);
      ASSERT_TRUE(rectifier->right(picture, out).ok());
      const std::uint8_t* memory = out.row(0);
      ASSERT_TRUE(rectifier->left(picture, out).ok());
      EXPECT_EQ(out.row(0), memory);
      const auto apart = rectifier->left(picture);
      EXPECT_TRUE(std::equal(out.row(0), out.row(0) + kRawWidth * kRawHeight, apart->row(0)));
    }
    EXPECT_EQ(rectifier->left(Image(64, 64), out).reason(), Reason::BAD_SIZE);
    EXPECT_EQ(out.width(), kRawWidth);
  }
}

TEST(Rectifier, OneCameraHasNoRightPicture) {
  StereoCalibration one = rig();
  one.right = {};
  const auto rectifier = Rectifier::make(one, kRawWidth, kRawHeight);
  ASSERT_TRUE(rectifier.ok()) << rectifier.status().to_string();
  EXPECT_EQ(rectifier->camera().baseline, 0);
  EXPECT_TRUE(rectifier->left(blob({100, 100})).ok());
  EXPECT_EQ(rectifier->right(blob({100, 100})).reason(), Reason::NOT_STEREO);
}

TEST(Rectifier, RefusesOtherSizesAndBadCalibrations) {
  EXPECT_EQ(Rectifier::make(rig(), 320, 240).reason(), Reason::BAD_SIZE);
  const auto rectifier = Rectifier::make(rig(), kRawWidth, kRawHeight);
  ASSERT_TRUE(rectifier.ok());
  EXPECT_EQ(rectifier->left(paint(64, 64, [](int, int) { return 0; })).reason(), Reason::BAD_SIZE);
  StereoCalibration mad = rig();
  mad.left.fx = -3;
  EXPECT_EQ(Rectifier::make(mad, kRawWidth, kRawHeight).reason(), Reason::IMPLAUSIBLE_CALIBRATION);
}

TEST(Rectifier, TellsWhereTheRawPictureShowsARectifiedPixel) {
  StereoCalibration calibration = rig();
  for (const bool mono : {false, true}) {
    if (mono) calibration.right = {};
    const auto rectifier = Rectifier::make(calibration, kRawWidth, kRawHeight);
    ASSERT_TRUE(rectifier.ok()) << rectifier.status().to_string();
    for (const Vector3& p : {Vector3(0, 0, 2), Vector3(0.5, -0.3, 2), Vector3(-0.8, 0.4, 3), Vector3(1.0, 0.6, 4)}) {
      const Vector2 rectified = rectifier->camera().project(rectifier->left_rotation() * p).head<2>();
      EXPECT_LT((rectifier->left_pixels().of(rectified) - project(calibration.left, p)).norm(), 1e-6);
    }
  }
}

}  // namespace
}  // namespace relmap::vision
