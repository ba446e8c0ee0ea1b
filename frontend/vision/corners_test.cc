#include "frontend/vision/corners.h"

#include <gtest/gtest.h>

#include "frontend/vision/textures_for_test.h"

namespace relmap::vision {
namespace {

using testing_textures::paint;

Image texture(double contrast) {
  const testing_textures::Waves waves(5, 6, 60);
  return paint(320, 240, [&](int x, int y) { return 128 + contrast * (waves.at(x, y) - 128); });
}

TEST(CornerDetector, FindsTheCornersOfASquare) {
  const Image picture = paint(200, 200, [](int x, int y) {
    return (x >= 60 && x < 140 && y >= 60 && y < 140 ? 220 : 40) + (x * 7 + y * 13) % 5;  // no two pixels tie
  });
  CornerDetector detector;
  const auto corners = detector.detect(Pyramid(picture, 1));
  ASSERT_GE(corners[0].size(), 4u);
  for (const Corner& corner : corners[0]) {
    EXPECT_LE(std::min(std::abs(corner.x - 60), std::abs(corner.x - 139)), 2);
    EXPECT_LE(std::min(std::abs(corner.y - 60), std::abs(corner.y - 139)), 2);
    EXPECT_GT(corner.score, 0);
  }
}

TEST(CornerDetector, SteersItsThresholdTowardTheWantedNumber) {
  for (const double contrast : {1.0, 0.3}) {
    CornerOptions options;
    options.wanted = 200;
    CornerDetector detector(options);
    std::vector<std::vector<Corner>> corners;
    const Pyramid pyramid(texture(contrast));
    for (int i = 0; i < 12; ++i) corners = detector.detect(pyramid);
    EXPECT_GT(corners[0].size(), 100u) << contrast;
    EXPECT_LT(corners[0].size(), 400u) << contrast;
  }
}

TEST(CornerDetector, KeepsRowOrderAndBorders) {
  CornerDetector detector;
  const auto levels = detector.detect(Pyramid(texture(0.5)));
  for (const auto& corners : levels) {
    EXPECT_TRUE(std::is_sorted(corners.begin(), corners.end(), [](const Corner& a, const Corner& b) {
      return std::pair(a.y, a.x) < std::pair(b.y, b.x);
    }));
    for (const Corner& corner : corners) EXPECT_TRUE(corner.x >= 8 && corner.y >= 8);
  }
}

TEST(HarrisScore, TellsCornersFromEdges) {
  const Image corner = paint(40, 40, [](int x, int y) { return x >= 20 && y >= 20 ? 200 : 50; });
  const Image edge = paint(40, 40, [](int x, int) { return x >= 20 ? 200 : 50; });
  const Image flat = paint(40, 40, [](int, int) { return 90; });
  EXPECT_GT(harris_score(corner, 20, 20), 0);
  EXPECT_LT(harris_score(edge, 20, 20), 0);
  EXPECT_EQ(harris_score(flat, 20, 20), 0);
}

}  // namespace
}  // namespace relmap::vision
