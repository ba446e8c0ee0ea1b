#include "tools/console/layout/line_importance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace relmap::console {
namespace {

std::vector<Vector2> wandering_line(std::uint32_t seed, std::size_t vertices) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::vector<Vector2> line;
  Vector2 at = Vector2::Zero();
  double heading = 0;
  for (std::size_t k = 0; k < vertices; ++k) {
    line.push_back(at);
    heading += 0.3 * normal(random);
    at += Vector2(std::cos(heading), std::sin(heading));
  }
  return line;
}

TEST(LineImportance, WhatIsLeftOutLiesWithinTheTolerance) {
  for (const std::uint32_t seed : {1u, 2u, 3u}) {
    const std::vector<Vector2> line = wandering_line(seed, 3000);
    const std::vector<float> importance = line_importance(line);
    ASSERT_EQ(importance.size(), line.size());
    std::size_t before = line.size() + 1;
    for (const double tolerance : {0.01, 0.1, 0.5, 2.0, 10.0}) {
      std::size_t kept = 0, last = 0;
      for (std::size_t k = 0; k < line.size(); ++k) {
        if (!(importance[k] > tolerance)) continue;
        ++kept;
        for (std::size_t i = last + 1; i < k; ++i)
          ASSERT_LE(distance_from_segment(line[i], line[last], line[k]), tolerance);
        last = k;
      }
      EXPECT_EQ(last, line.size() - 1);
      EXPECT_LT(kept, before);
      before = kept;
    }
    EXPECT_LT(before, 400u);
  }
}

TEST(LineImportance, OfAStraightLineOnlyTheEndsMatter) {
  std::vector<Vector2> line;
  for (int k = 0; k < 100; ++k) line.emplace_back(k, 2 * k);
  const std::vector<float> importance = line_importance(line);
  for (std::size_t k = 1; k + 1 < line.size(); ++k) EXPECT_LT(importance[k], 1e-6);
  EXPECT_TRUE(std::isinf(importance.front()) && std::isinf(importance.back()));
}

TEST(LineImportance, TakesAnyLine) {
  EXPECT_TRUE(line_importance({}).empty());
  EXPECT_EQ(line_importance(std::vector<Vector2>(1, Vector2(3, 4))).size(), 1u);
  for (const float importance : line_importance(std::vector<Vector2>(5000, Vector2(3, 4))))
    EXPECT_TRUE(importance < 1e-6 || std::isinf(importance));
}

}  // namespace
}  // namespace relmap::console
