#include "server/place/pixel_grid.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <vector>

namespace relmap::place {
namespace {

TEST(PixelGrid, FindsWhatAllDistancesFindAndEachPixelOnce) {
  std::mt19937 random(1);
  for (const double width : {100.0, 640.0, 5000.0}) {
    std::uniform_real_distribution<double> anywhere(-0.1 * width, 1.1 * width);
    std::vector<Vector2> pixels;
    for (int i = 0; i < 500; ++i) pixels.emplace_back(anywhere(random), anywhere(random));
    pixels.emplace_back(std::numeric_limits<double>::quiet_NaN(), 3);
    pixels.emplace_back(3, std::numeric_limits<double>::infinity());
    pixels.emplace_back(-1e9, -1e9);
    pixels.emplace_back(1e300, 0);
    const PixelGrid grid(pixels);
    for (const double radius : {0.5, 12.8, 40.0, 700.0, 20000.0})
      for (int i = 0; i < 50; ++i) {
        const Vector2 at = i == 0 ? pixels[0] : Vector2(anywhere(random), anywhere(random));
        std::vector<std::uint32_t> expected, found;
        for (std::uint32_t p = 0; p < 500; ++p)
          if ((at - pixels[p]).squaredNorm() < radius * radius) expected.push_back(p);
        grid.visit_near(at, radius, [&](std::uint32_t p) { found.push_back(p); });
        std::sort(found.begin(), found.end());
        EXPECT_EQ(found, expected) << "width " << width << ", radius " << radius;
      }
    grid.visit_near(pixels[500], 10, [](std::uint32_t) { FAIL() << "nothing is near no pixel"; });
  }
}

}  // namespace
}  // namespace relmap::place
