#include "server/place/stereo_pair.h"

#include <gtest/gtest.h>

#include "frontend/vision/textures_for_test.h"

namespace relmap::place {
namespace {

using vision::testing_textures::paint;
using vision::testing_textures::seen_twice;
using vision::testing_textures::Waves;

constexpr int kWidth = 320, kHeight = 240;
const StereoCamera kRig{300, 160, 120, 0.1, kWidth, kHeight};

// Checks two pictures of one wall. What the left picture shows at (u, v) is in the right one at (u - shift, v + rows).
Status check_wall(double shift, double rows, int width = kWidth, int height = kHeight) {
  std::mt19937 random(3);
  const auto [left, right] = seen_twice(Waves(3, 6, 60), random, width, height, -shift, rows);
  return check_stereo_pair(left, right, kRig);
}

TEST(StereoPair, PicturesOfTheTwoEyesAreAPair) {
  const Status status = check_wall(12, 0);
  EXPECT_TRUE(status.ok()) << status.to_string();
}

TEST(StereoPair, ExchangedPicturesAreRefused) {
  const Status status = check_wall(-12, 0);
  EXPECT_EQ(status.reason(), Reason::NOT_STEREO) << status.to_string();
  EXPECT_EQ(status.message().find("the pictures are not a pair of this camera, or not of one moment: "), 0U)
      << status.message();
}

TEST(StereoPair, RowsMoreThanTwoPixelsApartAreRefusedWithAdvice) {
  const Status apart = check_wall(12, 3);
  EXPECT_EQ(apart.reason(), Reason::ROWS_APART) << apart.to_string();
  EXPECT_NE(apart.message().find("what helps: "), std::string::npos) << apart.message();
  // The check of a rig reports rows from one pixel apart on, but verification tolerates more in a single pair.
  const Status near = check_wall(12, 1.5);
  EXPECT_TRUE(near.ok()) << near.to_string();
}

TEST(StereoPair, OnePictureTwiceIsRefused) {
  const Waves waves(3, 6, 60);
  const vision::Image picture = paint(kWidth, kHeight, [&](int x, int y) { return waves.at(x, y); });
  EXPECT_EQ(check_stereo_pair(picture, picture, kRig).reason(), Reason::NOT_STEREO);
}

TEST(StereoPair, ALeftPictureThatShowsNothingIsRefused) {
  const Waves waves(3, 6, 60);
  const vision::Image dark = paint(kWidth, kHeight, [](int, int) { return 0.0; });
  const vision::Image right = paint(kWidth, kHeight, [&](int x, int y) { return waves.at(x, y); });
  EXPECT_EQ(check_stereo_pair(dark, right, kRig).reason(), Reason::EYE_DEAD);
}

TEST(StereoPair, PicturesTooSmallToTellAreAccepted) {
  const Status status = check_wall(-12, 0, 60, 60);
  EXPECT_TRUE(status.ok()) << status.to_string();
}

}  // namespace
}  // namespace relmap::place
