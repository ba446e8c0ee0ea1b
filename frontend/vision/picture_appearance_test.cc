#include "frontend/vision/picture_appearance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "frontend/vision/appearance.h"

namespace relmap::vision {
namespace {

// Rectangles of all greys, one over the other.
Image rectangles(std::uint32_t seed) {
  Image image(512, 384);
  std::mt19937 random(seed);
  for (int i = 0; i < 600; ++i) {
    const auto grey = static_cast<std::uint8_t>(random());
    const int left = static_cast<int>(random() % 480), top = static_cast<int>(random() % 360);
    const int right = std::min(512, left + 12 + static_cast<int>(random() % 40));
    const int bottom = std::min(384, top + 12 + static_cast<int>(random() % 40));
    for (int y = top; y < bottom; ++y) std::fill(image.row(y) + left, image.row(y) + right, grey);
  }
  return image;
}

TEST(PictureAppearance, IsHalfCornersHalfKeypoints) {
  const auto features = picture_appearance(rectangles(1));
  EXPECT_LE(features.size(), static_cast<std::size_t>(kAppearanceFeatures));
  EXPECT_GT(features.size(), 200u);
  // Corners come first, on whole pixels of their level, and are described at sigma 2.5 x 2^level.
  const auto corners = std::count_if(features.begin(), features.end(), [](const AppearanceFeature& f) {
    return f.scale == 5 || f.scale == 10 || f.scale == 20 || f.scale == 40;
  });
  EXPECT_GT(corners, 80);
  EXPECT_LE(corners, 150);
  for (const AppearanceFeature& f : features) EXPECT_EQ(f.track, -1);
}

TEST(PictureAppearance, TheSamePictureGivesTheSameAnswer) {
  const auto a = picture_appearance(rectangles(2)), b = picture_appearance(rectangles(2));
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].u, b[i].u);
    EXPECT_EQ(a[i].descriptor, b[i].descriptor);
  }
}

TEST(PictureAppearance, IsEmptyForPicturesWithoutTexture) {
  EXPECT_TRUE(picture_appearance({}).empty());
  EXPECT_TRUE(picture_appearance(Image(10, 10)).empty());
  EXPECT_TRUE(picture_appearance(Image(200, 200)).empty());
}

}  // namespace
}  // namespace relmap::vision
