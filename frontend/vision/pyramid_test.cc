#include "frontend/vision/pyramid.h"

#include <gtest/gtest.h>

#include "frontend/vision/textures_for_test.h"

namespace relmap::vision {
namespace {

using testing_textures::paint;

TEST(Pyramid, HalvesUntilAPictureIsSmall) {
  const Image picture = paint(320, 140, [](int x, int) { return x / 2; });
  const Pyramid pyramid(picture);
  ASSERT_EQ(pyramid.levels(), 3);  // 140, 70, 35
  EXPECT_EQ(pyramid.level(1).width, 160);
  EXPECT_EQ(pyramid.level(2).height, 35);
  EXPECT_EQ(Pyramid(paint(20, 20, [](int, int) { return 0; })).levels(), 1);
  EXPECT_EQ(Pyramid(picture, 2).levels(), 2);
}

TEST(Pyramid, LevelCoordinatesPointAtTheSamePlaceOfThePicture) {
  // A ramp has at every place of every level the value of that place in the picture.
  const Image picture = paint(256, 256, [](int x, int) { return x; });
  const Pyramid pyramid(picture);
  for (int level = 0; level < pyramid.levels(); ++level)
    for (int x = 1; x < pyramid.level(level).width - 1; ++x)
      EXPECT_NEAR(pyramid.level(level).at(x, 5), from_level(static_cast<float>(x), level), 0.51 + 0.5 * level);
  for (int level = 0; level < 4; ++level) EXPECT_FLOAT_EQ(to_level(from_level(17.25F, level), level), 17.25F);
}

}  // namespace
}  // namespace relmap::vision
