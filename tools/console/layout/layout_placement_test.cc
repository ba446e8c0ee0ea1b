#include "tools/console/layout/layout_placement.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace relmap::console {
namespace {

void expect_apart(const std::vector<PlacedPart>& parts) {
  for (std::size_t i = 0; i < parts.size(); ++i)
    for (std::size_t k = 0; k < i; ++k) {
      const LayoutBox &x = parts[i].box, &y = parts[k].box;
      EXPECT_FALSE(x.low.x() < y.high.x() && y.low.x() < x.high.x() && x.low.y() < y.high.y() && y.low.y() < x.high.y())
          << i << " and " << k;
    }
}

std::vector<PlacedPart> some_parts(std::uint32_t seed, std::size_t count) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<PlacedPart> parts(count);
  double extent = 100;
  for (PlacedPart& part : parts) {
    part.box.low = 50 * Vector2(uniform(random), uniform(random));
    part.box.high = part.box.low + extent * Vector2(uniform(random), uniform(random));
    extent *= 0.95;
  }
  return parts;
}

TEST(LayoutPlacement, PartsDoNotOverlap) {
  for (std::uint32_t seed = 1; seed < 20; ++seed) {
    std::vector<PlacedPart> parts = some_parts(seed, 1 + 7 * seed);
    const std::vector<PlacedPart> given = parts;
    for (std::size_t k = 0; k < parts.size(); k += seed % 3 + 1) parts[k].kept = true;
    place_parts(parts);
    expect_apart(parts);
    for (std::size_t k = 0; k < parts.size(); ++k) {
      EXPECT_LT((parts[k].box.size() - given[k].box.size()).norm(), 1e-9);
      EXPECT_TRUE(!parts[k].kept || parts[k].box == given[k].box);
    }
  }
}

TEST(LayoutPlacement, WhatWasPlacedOnceStays) {
  std::vector<PlacedPart> parts = some_parts(3, 30);
  place_parts(parts);
  const std::vector<PlacedPart> first = parts;
  for (PlacedPart& part : parts) part.kept = true;
  parts.push_back(some_parts(4, 1)[0]);  // a new one comes
  place_parts(parts);
  expect_apart(parts);
  for (std::size_t k = 0; k < first.size(); ++k) EXPECT_EQ(parts[k].box, first[k].box) << k;
}

TEST(LayoutPlacement, ASparseWholeIsPackedAnew) {
  std::vector<PlacedPart> parts(2);
  parts[0] = {{{0, 0}, {10, 10}}, true};
  parts[1] = {{{5000, 3000}, {5010, 3010}}, true};
  place_parts(parts);
  EXPECT_EQ(parts[0].box.low, Vector2(0, 0));
  EXPECT_FALSE(parts[1].kept);
  EXPECT_LT((parts[1].box.low - parts[0].box.low).norm(), 100);
}

TEST(LayoutPlacement, AFitFindsTheMotion) {
  PlaneMotion truth;
  truth.cosine = std::cos(2.0);
  truth.sine = std::sin(2.0);
  truth.shift = {1000, -3000};
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  PlaneFit fit;
  for (int k = 0; k < 500; ++k) {
    const Vector2 from(8000 + 50 * normal(random), 50 * normal(random));
    fit.add(from, truth(from) + 0.01 * Vector2(normal(random), normal(random)), 0, 2);
  }
  const PlaneMotion found = fit.motion();
  EXPECT_LT((found(Vector2(8010, 20)) - truth(Vector2(8010, 20))).norm(), 0.01);
  EXPECT_EQ(fit.pairs(), 500u);

  PlaneFit one;  // a place and a direction
  one.add({1, 2}, {5, 5}, 0.5, 1.5);
  EXPECT_LT((one.motion()(Vector2(1, 2)) - Vector2(5, 5)).norm(), 1e-9);
  EXPECT_NEAR(std::atan2(one.motion().sine, one.motion().cosine), 1, 1e-9);
}

TEST(LayoutPlacement, AMapIsTurnedToBeLow) {
  std::vector<Vector2> tall;
  for (int k = 0; k < 100; ++k) tall.emplace_back(0.3 * k, k);
  const PlaneMotion turn = lowest_turn(tall);
  for (const Vector2& p : tall) EXPECT_LT(std::abs(turn.turned(p).y()), 5);
}

TEST(LayoutPlacement, TheWorldStaysAsLongAsItFits) {
  const LayoutBox box{{10, 10}, {110, 60}};
  const WorldSquare world = world_around(box, {});
  EXPECT_EQ(world.size, 128);
  EXPECT_TRUE((world.corner.array() <= box.low.array()).all());
  const LayoutBox more{{5, 10}, {112, 60}};
  EXPECT_EQ(world_around(more, world).corner, world.corner);
  const LayoutBox far{{5, 10}, {400, 60}};
  EXPECT_EQ(world_around(far, world).size, 512);
  EXPECT_EQ(world_around({{10, 10}, {20, 20}}, world_around(far, {})).size, 16);
}

}  // namespace
}  // namespace relmap::console
