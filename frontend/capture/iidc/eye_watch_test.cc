#include "frontend/capture/iidc/eye_watch.h"

#include <gtest/gtest.h>

#include <random>

namespace relmap::iidc {
namespace {

vision::Image noise(unsigned seed, int mean = 120, int range = 100) {
  std::mt19937 random(seed);
  vision::Image picture(320, 240);
  for (int y = 0; y < 240; ++y)
    for (int x = 0; x < 320; ++x)
      picture.row(y)[x] = static_cast<std::uint8_t>(mean - range / 2 + static_cast<int>(random() % (range + 1u)));
  return picture;
}

TEST(IidcEyeWatch, EyesThatSeeAreLeftAlone) {
  EyeWatch watch;
  for (unsigned i = 0; i < 20; ++i) {
    const auto verdict = watch.look(noise(2 * i), noise(2 * i + 1));
    EXPECT_TRUE(verdict.left.ok() && verdict.right.ok());
  }
}

TEST(IidcEyeWatch, ABlankEyeIsDeadWhereTheOtherSees) {
  EyeWatch watch;
  const auto right = watch.look(noise(1), noise(2, 3, 4));
  EXPECT_TRUE(right.left.ok());
  EXPECT_EQ(right.right.reason(), Reason::EYE_DEAD);
  EXPECT_NE(right.right.message().find("right eye"), std::string::npos);
  EXPECT_EQ(watch.look(noise(3, 255, 0), noise(4)).left.reason(), Reason::EYE_DEAD);
  const auto night = watch.look(noise(5, 3, 4), noise(6, 3, 4));
  EXPECT_TRUE(night.left.ok() && night.right.ok());
}

TEST(IidcEyeWatch, AnEyeThatDoesNotChangeIsDeadUntilItDoes) {
  EyeWatch watch;
  const vision::Image frozen = noise(7);
  int dead = 0;
  for (unsigned i = 0; i < 20; ++i) dead += !watch.look(frozen, noise(100 + i)).left.ok();
  EXPECT_EQ(dead, 15);
  EXPECT_TRUE(watch.look(noise(8), noise(300)).left.ok());
  // A camera that gives the same pair again has two sound eyes.
  const vision::Image right = noise(301);
  for (int i = 0; i < 10; ++i) {
    const auto verdict = watch.look(frozen, right);
    EXPECT_TRUE(verdict.left.ok() && verdict.right.ok()) << i;
  }
}

}  // namespace
}  // namespace relmap::iidc
