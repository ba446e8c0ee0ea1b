#include "tools/sim/exposure.h"

#include <gtest/gtest.h>

#include <cmath>

namespace relmap::sim {
namespace {

TEST(Exposure, JumpsAsOftenAsAskedForAndRecovers) {
  PictureWorldOptions options;
  options.exposure_variation = 0;
  options.exposure_jumps = 2;
  const Exposure exposure(options);
  int jumps = 0, as_painted = 0;
  for (int i = 1; i < 10'000; ++i) {
    const double before = exposure.gain(i - 1, 0), gain = exposure.gain(i, 0);
    if (std::abs(gain - before) > 0.08) ++jumps;  // going back takes steps of less than 0.06
    if (gain == 1) ++as_painted;
  }
  EXPECT_NEAR(jumps, 170, 40);  // some are too small to tell
  EXPECT_GT(as_painted, 7'500);
}

TEST(Exposure, WithoutJumpsVariesSlowlyWithinItsBounds) {
  const PictureWorldOptions options;
  const Exposure exposure(options);
  for (int i = 0; i < 300; ++i) {
    const double gain = exposure.gain(i, 0.2 * i);
    EXPECT_NEAR(gain, 1, options.exposure_variation);
    EXPECT_NEAR(gain, exposure.gain(i + 1, 0.2 * (i + 1)), 0.01);
  }
}

}  // namespace
}  // namespace relmap::sim
