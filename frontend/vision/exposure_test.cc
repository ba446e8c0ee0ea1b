#include "frontend/vision/exposure.h"

#include <gtest/gtest.h>

#include "frontend/vision/textures_for_test.h"

namespace relmap::vision {
namespace {

using testing_textures::paint;

TEST(Exposure, StandardisedPicturesOfOneSceneAreAlike) {
  const testing_textures::Waves waves(3);
  const Image bright = paint(200, 150, [&](int x, int y) { return waves.at(x, y); });
  const Image dim = paint(200, 150, [&](int x, int y) { return 30 + 0.4 * waves.at(x, y); });
  const Image a = standardise(bright, measure_exposure(bright)), b = standardise(dim, measure_exposure(dim));
  for (int y = 0; y < 150; y += 11)
    for (int x = 0; x < 200; x += 7) EXPECT_NEAR(a.at(x, y), b.at(x, y), 3);
  const Exposure standard = measure_exposure(b);
  EXPECT_NEAR(standard.mean, 112, 1);
  EXPECT_NEAR(standard.deviation, 48, 1);
}

TEST(Exposure, KnowsAnEyeThatSeesNothing) {
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0, 2);
  EXPECT_TRUE(measure_exposure(paint(200, 150, [&](int, int) { return noise(random); })).blind());
  EXPECT_TRUE(measure_exposure(paint(200, 150, [](int, int) { return 255; })).blind());
  const testing_textures::Waves waves(3);
  EXPECT_FALSE(measure_exposure(paint(200, 150, [&](int x, int y) { return 0.2 * waves.at(x, y); })).blind());
  const Image flat = paint(200, 150, [](int, int) { return 40; });
  EXPECT_NEAR(standardise(flat, measure_exposure(flat)).at(10, 10), 112, 1);
  EXPECT_TRUE(measure_exposure({}).blind());
}

}  // namespace
}  // namespace relmap::vision
