#include "tools/sim/daylight.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "tools/sim/grey_levels_for_test.h"

namespace relmap::sim {
namespace {

constexpr std::array kAll{Daylight::kClear, Daylight::kMorning, Daylight::kEvening, Daylight::kOvercast,
                          Daylight::kDusk};

PictureWorldOptions drive(std::uint64_t drive_seed, Daylight light) {
  PictureWorldOptions options;
  options.drive_seed = drive_seed;
  options.light = light;
  options.frames = 140;
  options.noise = 0;
  options.exposure_variation = 0;
  options.camera = {.f = 200, .cx = 127.5, .cy = 95.5, .baseline = 0.2, .width = 256, .height = 192};
  return options;
}

TEST(Daylight, NamesAreReadAsTheyAreWritten) {
  for (const Daylight light : kAll) EXPECT_EQ(daylight_of(daylight_name(light)), light);
  EXPECT_EQ(daylight_of("noon"), std::nullopt);
}

TEST(Daylight, TheSamePlaceLooksDifferentAndStaysWhereItWas) {
  const PictureWorld clear(drive(1, Daylight::kClear));
  const StereoPictures as_painted = clear.render(20);
  for (const Daylight light : kAll) {
    if (light == Daylight::kClear) continue;
    const PictureWorld world(drive(1, light));
    EXPECT_EQ(world.render_depth(20), clear.render_depth(20));
    const StereoPictures pair = world.render(20);
    // Not by one factor: what is brighter than by the mean, and what is darker.
    const double factor = mean_grey(pair.left) / mean_grey(as_painted.left);
    EXPECT_LT(factor, 0.95) << daylight_name(light);
    EXPECT_GT(factor, 0.2) << daylight_name(light);
    std::size_t brighter = 0, darker = 0;
    for (std::size_t k = 0; k < pair.left.pixels.size(); ++k) {
      const double expected = factor * as_painted.left.pixels[k];
      brighter += pair.left.pixels[k] > 1.05 * expected + 2;
      darker += pair.left.pixels[k] < 0.95 * expected - 2;
    }
    EXPECT_GT(brighter, pair.left.pixels.size() / 50) << daylight_name(light);
    EXPECT_GT(darker, pair.left.pixels.size() / 50) << daylight_name(light);
  }
}

TEST(Daylight, AnotherDriveIsInTheSameWorld) {
  PictureWorldOptions options = drive(1, Daylight::kClear);
  const PictureWorld first(options);
  options.start = 7;
  options.drive_seed = 2;
  const PictureWorld second(options);
  // Along the same road, at most the deviation beside it, and from elsewhere on.
  const auto to_road = [](const PictureWorld& from, int i, const PictureWorld& road) {
    double min_distance = 1e9;
    for (int j = 0; j < road.options().frames; ++j)
      min_distance = std::min(min_distance, (road.truth(j).t - from.truth(i).t).norm());
    return min_distance;
  };
  double apart = 0;
  for (int i = 0; i < options.frames; i += 5) {
    const double metres = to_road(second, i, first);
    EXPECT_LT(metres, 2 * options.lateral_deviation + options.step);
    apart = std::max(apart, metres);
  }
  EXPECT_GT(apart, 0.1);
  EXPECT_GT((first.truth(0).t - second.truth(0).t).norm(), 3);
}

TEST(Daylight, ADriveWithoutASeedTakesTheWorlds) {
  PictureWorldOptions options = drive(1, Daylight::kClear);
  options.noise = 2;
  const StereoPictures seeded = PictureWorld(options).render(3);
  options.drive_seed.reset();
  EXPECT_EQ(PictureWorld(options).render(3).left.pixels, seeded.left.pixels);
  options.drive_seed = 2;
  EXPECT_NE(PictureWorld(options).render(3).left.pixels, seeded.left.pixels);
}

}  // namespace
}  // namespace relmap::sim
