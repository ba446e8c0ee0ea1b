#include "tools/sim/texture.h"

#include <gtest/gtest.h>

namespace relmap::sim {
namespace {

TEST(Canvas, ShapesStandWhereTheyArePut) {
  Canvas canvas(2, 1, 100, 50);
  canvas.fill_rect(0.5, 0.2, 1.0, 0.4, 200);
  EXPECT_EQ(canvas.at(49, 30), 50);
  EXPECT_EQ(canvas.at(50, 30), 200);
  EXPECT_EQ(canvas.at(99, 39), 200);
  EXPECT_EQ(canvas.at(100, 39), 50);
  EXPECT_EQ(canvas.at(60, 40), 50);
  canvas.fill_polygon({{0, 0.5}, {0.4, 0.5}, {0, 0.9}}, 10);
  EXPECT_EQ(canvas.at(2, 52), 10);
  EXPECT_EQ(canvas.at(38, 88), 50);
  canvas.fill_ellipse(1.5, 0.7, 0.2, 0.1, 90);
  EXPECT_EQ(canvas.at(150, 70), 90);
  EXPECT_EQ(canvas.at(167, 62), 50);
  canvas.fill_rect(-5, -5, 50, 50, 7);  // cut off at the border
  EXPECT_EQ(canvas.at(199, 99), 7);
}

TEST(Texture, SamplesLinearlyBetweenTexels) {
  Canvas canvas(1.28, 1.28, 100, 0);
  canvas.fill_rect(0.64, 0, 1.28, 1.28, 200);
  const Texture texture(canvas);
  EXPECT_FLOAT_EQ(texture.sample(30, 30, 0), 0);
  EXPECT_FLOAT_EQ(texture.sample(63.5F, 30, 0), 100);
  EXPECT_FLOAT_EQ(texture.sample(63.25F, 30, 0), 50);
  EXPECT_FLOAT_EQ(texture.sample(1000, -1000, 0), texture.sample(126.9F, 0, 0));
}

TEST(Texture, LevelsKeepThePlaceAndTheMean) {
  Canvas canvas(1.28, 1.28, 100, 0);
  for (int k = 0; k < 64; ++k) canvas.fill_rect(k * 0.02, 0, k * 0.02 + 0.01, 1.28, 240);  // stripes of a texel
  const Texture stripes(canvas);
  EXPECT_FLOAT_EQ(stripes.sample(20, 20, 1), 120);
  EXPECT_FLOAT_EQ(stripes.sample(77, 91, 5), 120);
  canvas.fill_rect(0, 0, 1.28, 1.28, 0);
  canvas.fill_rect(0.64, 0, 1.28, 1.28, 200);
  const Texture edge(canvas);
  for (int level = 0; level <= 4; ++level) EXPECT_FLOAT_EQ(edge.sample(63.5F, 64, level), 100) << level;
}

}  // namespace
}  // namespace relmap::sim
