#include "frontend/vision/corner_match.h"

#include <gtest/gtest.h>

#include "frontend/vision/textures_for_test.h"

namespace relmap::vision {
namespace {

using testing_textures::seen_twice;
using testing_textures::Waves;

TEST(CornerMatch, FindsAShiftInAnyDirection) {
  for (const auto& [dx, dy] : {std::pair{-30.3, 0.0}, {25.6, 12.4}, {-60.2, -20.7}}) {
    std::mt19937 random(3);
    const auto [left, right] = seen_twice(Waves(4, 6, 60), random, 320, 240, dx, dy);
    const auto matches = match_corners(left, right);
    ASSERT_GE(matches.size(), 60u);
    int wrong = 0;
    double squares = 0;
    for (const CornerMatch& match : matches) {
      const double ex = match.u_right - match.u_left - dx, ey = match.v_right - match.v_left - dy;
      if (std::hypot(ex, ey) > 1)
        ++wrong;
      else
        squares += ex * ex + ey * ey;
    }
    EXPECT_LE(wrong, static_cast<int>(matches.size() / 50)) << dx << ", " << dy;
    EXPECT_LT(std::sqrt(squares / static_cast<double>(matches.size())), 0.1);
  }
}

TEST(CornerMatch, SearchesOnlyWithinItsRange) {
  std::mt19937 random(3);
  const auto [left, right] = seen_twice(Waves(4, 6, 60), random, 320, 240, -30, 12);
  EXPECT_LE(match_corners(left, right, {.rows = 0.04F}).size(), 10u);     // 9 rows
  EXPECT_LE(match_corners(left, right, {.columns = 0.08F}).size(), 10u);  // 25 columns
}

TEST(CornerMatch, FindsNothingWhereNothingIsShared) {
  std::mt19937 random(3);
  const auto [left, copy] = seen_twice(Waves(4, 6, 60), random, 320, 240, 0, 0);
  const auto [other, right] = seen_twice(Waves(5, 6, 60), random, 320, 240, 0, 0);
  EXPECT_LE(match_corners(left, right).size(), 10u);
  EXPECT_TRUE(match_corners(left, Image(320, 240)).empty());
  EXPECT_TRUE(match_corners(Image(320, 240), right).empty());
}

}  // namespace
}  // namespace relmap::vision
