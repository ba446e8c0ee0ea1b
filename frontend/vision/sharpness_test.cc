#include "frontend/vision/sharpness.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "frontend/vision/textures_for_test.h"

namespace relmap::vision {
namespace {

using testing_textures::paint;

// Tiles of 40 pixels, whose edges are steps blurred by a Gaussian; at a blur of 0 they lie between two pixels.
Image tiles(double blur, double dark = 60, double bright = 200, double noise = 0) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal(0, 1);
  const auto wave = [&](double x) {  // -1 and 1 in turn, 40 pixels each
    const double from_edge = x - 40 * std::round(x / 40), sign = std::lround(x / 40) % 2 ? -1 : 1;
    return sign * (blur > 0 ? std::erf(from_edge / (blur * std::sqrt(2.0))) : from_edge < 0 ? -1 : 1);
  };
  return paint(400, 320, [&](int x, int y) {
    return dark + (bright - dark) * (1 + wave(x + 0.5) * wave(y + 0.5)) / 2 + noise * normal(random);
  });
}

TEST(EdgeWidth, IsThatOfTheBlur) {
  EXPECT_NEAR(*edge_width(tiles(0)), 2, 0.01);
  for (const double blur : {1.0, 2.0, 3.0, 4.0}) {
    const double expected = std::sqrt(2 * M_PI * (blur * blur + 1.0 / 3));  // slopes are taken over two pixels
    EXPECT_NEAR(*edge_width(tiles(blur)) / expected, 1, blur > 1 ? 0.05 : 0.12) << blur;
  }
}

TEST(EdgeWidth, DoesNotDependOnTheExposure) {
  const double width = *edge_width(tiles(2));
  EXPECT_NEAR(*edge_width(tiles(2, 40, 90)), width, 0.05 * width);
  EXPECT_NEAR(*edge_width(tiles(2, 150, 240)), width, 0.05 * width);
  EXPECT_NEAR(*edge_width(tiles(2, 60, 200, 1.5)), width, 0.1 * width);  // noise
}

TEST(EdgeWidth, IgnoresClippedEdges) {  // they look three times as sharp
  const double width = *edge_width(tiles(3));
  EXPECT_GT(edge_width(tiles(3, 60, 600)).value_or(width), 0.9 * width);
  EXPECT_GT(edge_width(tiles(3, -400, 200)).value_or(width), 0.9 * width);
}

TEST(EdgeWidth, MotionBlursInOneDirection) {
  Image picture = tiles(1);
  const double width = *edge_width(picture);
  cv::Mat pixels(picture.height(), picture.width(), CV_8UC1, picture.row(0));
  cv::blur(pixels, pixels, {9, 1});
  EXPECT_NEAR(*edge_width(picture), width, 0.1 * width);
}

TEST(EdgeWidth, NeedsEdges) {
  EXPECT_FALSE(edge_width({}).has_value());
  EXPECT_FALSE(edge_width(Image(64, 64)).has_value());
  EXPECT_FALSE(edge_width(tiles(0, 100, 100, 3)).has_value());
  EXPECT_FALSE(edge_width(paint(1, 300, [](int, int y) { return y; })).has_value());
}

}  // namespace
}  // namespace relmap::vision
