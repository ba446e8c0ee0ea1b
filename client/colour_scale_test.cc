#include "client/colour_scale.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace relmap::client {
namespace {

double lightness(Colour colour) {
  const auto linear = [](std::uint8_t value) {
    const double c = value / 255.0;
    return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
  };
  const double y = 0.2126 * linear(colour.red) + 0.7152 * linear(colour.green) + 0.0722 * linear(colour.blue);
  return y > 216.0 / 24389 ? 116 * std::cbrt(y) - 16 : 24389.0 / 27 * y;
}

void expect_near(Colour colour, Colour expected) {
  EXPECT_NEAR(colour.red, expected.red, 6);
  EXPECT_NEAR(colour.green, expected.green, 6);
  EXPECT_NEAR(colour.blue, expected.blue, 6);
}

TEST(ColourScale, IsThatOfItsMakers) {
  expect_near(viridis(0), {68, 1, 84});
  expect_near(viridis(0.5), {33, 145, 140});
  expect_near(viridis(1), {253, 231, 37});
  expect_near(plasma(0), {13, 8, 135});
  expect_near(plasma(0.5), {204, 71, 120});
  expect_near(plasma(1), {240, 249, 33});
}

// So that whoever sees no colours sees the order.
TEST(ColourScale, LightnessRisesEvenly) {
  for (const auto scale : {viridis, plasma})
    for (double t = 0; t < 0.95; t += 0.1) {
      const double step = lightness(scale(t + 0.1)) - lightness(scale(t));
      EXPECT_GT(step, 4) << t;
      EXPECT_LT(step, 13) << t;
    }
}

TEST(ColourScale, IsDarkOnPaperAndBrightOnPictures) {
  for (double t = 0; t <= 1; t += 0.05) {
    EXPECT_LT(lightness(paper_scale(t)), 82) << t;
    EXPECT_GT(lightness(picture_scale(t)), 35) << t;
  }
  EXPECT_LT(lightness(paper_scale(1)), 20) << "the largest value is the darkest";
}

TEST(ColourScale, ValuesOutsideAreTheNearest) {
  EXPECT_TRUE(viridis(-3) == viridis(0));
  EXPECT_TRUE(plasma(7) == plasma(1));
  EXPECT_TRUE(viridis(std::numeric_limits<double>::quiet_NaN()) == viridis(0));
}

}  // namespace
}  // namespace relmap::client
