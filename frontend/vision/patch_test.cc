#include "frontend/vision/patch.h"

#include <gtest/gtest.h>

#include "frontend/vision/textures_for_test.h"

namespace relmap::vision {
namespace {

using testing_textures::paint;
using testing_textures::Waves;

int naive_sad(ImageView a, int ax, int ay, ImageView b, int bx, int by) {
  double difference = 0;
  for (int dy = -4; dy <= 4; ++dy)
    for (int dx = -4; dx <= 4; ++dx) difference += b.at(bx + dx, by + dy) - a.at(ax + dx, ay + dy);
  const int shift = static_cast<int>(std::lround(difference / 81));
  int sad = 0;
  for (int dy = -4; dy <= 4; ++dy)
    for (int dx = -4; dx <= 4; ++dx)
      sad += std::abs(std::clamp(a.at(ax + dx, ay + dy) + shift, 0, 255) - b.at(bx + dx, by + dy));
  return sad;
}

TEST(SadPatch, IsTheSumOfDifferencesAfterAShiftOfMeans) {
  std::mt19937 random(2);
  const Image a = paint(60, 50, [&](int, int) { return static_cast<int>(random() % 256); });
  const Image b = paint(60, 50, [&](int, int) { return static_cast<int>(random() % 120); });
  for (int i = 0; i < 200; ++i) {
    const int ax = 4 + static_cast<int>(random() % 52), ay = 4 + static_cast<int>(random() % 42);
    const int bx = 4 + static_cast<int>(random() % 52), by = 4 + static_cast<int>(random() % 42);
    EXPECT_EQ(SadPatch(a, ax, ay).compare(b, bx, by), naive_sad(a, ax, ay, b, bx, by));
  }
  EXPECT_EQ(SadPatch(a, 20, 20).compare(a, 20, 20), 0);
}

TEST(SadPatch, DoesNotMindBrightness) {
  const Waves waves(4);
  const Image dark = paint(40, 40, [&](int x, int y) { return 0.5 * waves.at(x, y); });
  const Image bright = paint(40, 40, [&](int x, int y) { return 60 + 0.5 * waves.at(x, y); });
  EXPECT_LE(SadPatch(dark, 20, 20).compare(bright, 20, 20), 81);
}

}  // namespace
}  // namespace relmap::vision
