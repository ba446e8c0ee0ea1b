#include "frontend/vision/spread.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace relmap::vision {
namespace {

std::vector<Corner> scatter(int count, unsigned seed, int x0, int x1, int y0, int y1) {
  std::mt19937 random(seed);
  std::vector<Corner> corners;
  for (int i = 0; i < count; ++i)
    corners.push_back({static_cast<std::int16_t>(x0 + static_cast<int>(random() % static_cast<unsigned>(x1 - x0))),
                       static_cast<std::int16_t>(y0 + static_cast<int>(random() % static_cast<unsigned>(y1 - y0))),
                       static_cast<float>(random() % 1000)});
  return corners;
}

std::vector<int> quarters(const std::vector<Corner>& corners, const std::vector<std::uint32_t>& chosen) {
  std::vector<int> count(4, 0);
  for (const auto i : chosen) ++count[static_cast<std::size_t>((corners[i].x >= 320) + 2 * (corners[i].y >= 240))];
  return count;
}

TEST(ChooseSpread, GivesEachQuarterItsShare) {
  // Nine tenths of the candidates, and the best, crowd in one quarter.
  auto corners = scatter(900, 1, 10, 310, 10, 230);
  for (Corner& c : corners) c.score += 1000;
  for (const auto& c : scatter(300, 2, 10, 630, 10, 470)) corners.push_back(c);
  const auto chosen = choose_spread(corners, {}, 640, 480, 100, 6);
  ASSERT_EQ(chosen.size(), 100u);
  for (const int count : quarters(corners, chosen)) EXPECT_NEAR(count, 25, 1);
}

TEST(ChooseSpread, CountsTakenPoints) {
  const auto corners = scatter(1000, 3, 10, 630, 10, 470);
  std::vector<PicturePoint> taken;
  for (int i = 0; i < 40; ++i) taken.push_back({20.0F + 7 * static_cast<float>(i), 100});
  const auto chosen = choose_spread(corners, taken, 640, 480, 100, 6);
  EXPECT_EQ(chosen.size(), 60u);
  EXPECT_LE(quarters(corners, chosen)[0], 2);
  for (const auto i : chosen)
    for (const auto& p : taken) EXPECT_GE(std::hypot(corners[i].x - p.x, corners[i].y - p.y), 6);
}

TEST(ChooseSpread, GivesTheShortfallOfAQuarterToTheOthers) {
  const auto corners = scatter(500, 4, 10, 310, 10, 230);
  EXPECT_EQ(choose_spread(corners, {}, 640, 480, 100, 6).size(), 100u);
}

TEST(ChooseSpread, KeepsADistanceAndPrefersScores) {
  const auto corners = scatter(2000, 5, 10, 630, 10, 470);
  const auto chosen = choose_spread(corners, {}, 640, 480, 150, 20);
  double all = 0, mean = 0;
  for (const auto i : chosen) {
    mean += corners[i].score / static_cast<double>(chosen.size());
    for (const auto k : chosen)
      if (i != k) {
        EXPECT_GE(std::hypot(corners[i].x - corners[k].x, corners[i].y - corners[k].y), 20);
      }
  }
  for (const auto& c : corners) all += c.score / static_cast<double>(corners.size());
  EXPECT_GT(mean, 1.3 * all);
}

TEST(ChooseSpread, ChoosesNothingWithoutCandidatesOrDemand) {
  EXPECT_TRUE(choose_spread({}, {}, 640, 480, 100, 6).empty());
  const auto corners = scatter(10, 6, 10, 630, 10, 470);
  EXPECT_TRUE(choose_spread(corners, {}, 640, 480, 0, 6).empty());
  EXPECT_EQ(choose_spread(corners, {}, 640, 480, 100, 1).size(), 10u);
}

}  // namespace
}  // namespace relmap::vision
