#include "server/route/overlay/bisection.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace relmap::route {
namespace {

// Streets: width x height crossings.
WeightedGraph grid(std::uint32_t width, std::uint32_t height) {
  std::vector<WeightedPair> pairs;
  for (std::uint32_t y = 0; y < height; ++y)
    for (std::uint32_t x = 0; x < width; ++x) {
      if (x + 1 < width) pairs.push_back({y * width + x, y * width + x + 1, 1});
      if (y + 1 < height) pairs.push_back({y * width + x, (y + 1) * width + x, 1});
    }
  return make_weighted_graph(std::vector<std::uint32_t>(std::size_t{width} * height, 1), pairs);
}

std::uint64_t larger_side(const WeightedGraph& graph, const std::vector<std::uint8_t>& side) {
  std::uint64_t sizes[2] = {0, 0};
  for (std::uint32_t v = 0; v < graph.nodes(); ++v) sizes[side[v]] += graph.size[v];
  return std::max(sizes[0], sizes[1]);
}

TEST(Bisection, PairsAreAddedInAnyOrder) {
  const WeightedGraph graph = make_weighted_graph({1, 1, 1}, {{0, 1, 2}, {1, 0, 3}, {2, 2, 7}});
  ASSERT_EQ(graph.arcs.size(), 2u);
  EXPECT_EQ(graph.arcs[graph.begin[0]].to, 1u);
  EXPECT_EQ(graph.arcs[graph.begin[0]].weight, 5u);
  EXPECT_EQ(graph.begin[3] - graph.begin[2], 0u);
}

TEST(Bisection, ALongGridIsCutAcross) {
  const WeightedGraph graph = grid(200, 20);
  const auto side = bisect(graph);
  EXPECT_LE(larger_side(graph, side), 0.6 * graph.nodes() + 1);
  EXPECT_LE(cut_of(graph, side), 24u) << "20 streets at best";
}

TEST(Bisection, ASquareIsCutAboutAsWellAsAStraightLineWould) {
  const WeightedGraph graph = grid(100, 100);
  const auto side = bisect(graph);
  EXPECT_LE(larger_side(graph, side), 0.6 * graph.nodes() + 1);
  EXPECT_LE(cut_of(graph, side), 115u);
}

TEST(Bisection, TheBridgeBetweenTwoTownsIsFound) {
  std::mt19937 random(3);
  std::vector<WeightedPair> pairs;
  for (std::uint32_t i = 0; i < 3000; ++i) {
    const std::uint32_t town = i % 2 * 500;
    pairs.push_back({town + static_cast<std::uint32_t>(random() % 500),
                     town + static_cast<std::uint32_t>(random() % 500), 1 + static_cast<std::uint32_t>(random() % 3)});
  }
  for (std::uint32_t i = 0; i + 1 < 500; ++i) pairs.push_back({i, i + 1, 1}), pairs.push_back({500 + i, 501 + i, 1});
  pairs.push_back({17, 900, 1});
  const WeightedGraph graph = make_weighted_graph(std::vector<std::uint32_t>(1000, 1), pairs);
  EXPECT_EQ(cut_of(graph, bisect(graph)), 1u);
}

TEST(Bisection, SmallAndDisconnectedGraphsHaveTwoSides) {
  EXPECT_EQ(bisect(WeightedGraph{}).size(), 0u);
  EXPECT_EQ(bisect(make_weighted_graph({5}, {})), (std::vector<std::uint8_t>{0}));
  std::mt19937 random(5);
  for (int trial = 0; trial < 500; ++trial) {
    const auto nodes = static_cast<std::uint32_t>(2 + random() % 150);
    std::vector<std::uint32_t> sizes(nodes);
    for (auto& size : sizes) size = 1 + static_cast<std::uint32_t>(random() % 4);
    std::vector<WeightedPair> pairs;
    for (std::size_t i = random() % (2 * nodes); i > 0; --i)
      pairs.push_back({static_cast<std::uint32_t>(random() % nodes), static_cast<std::uint32_t>(random() % nodes), 1});
    const WeightedGraph graph = make_weighted_graph(sizes, pairs);
    const auto side = bisect(graph);
    EXPECT_EQ(*std::min_element(side.begin(), side.end()), 0);
    EXPECT_EQ(*std::max_element(side.begin(), side.end()), 1);
    std::uint64_t whole = 0;
    for (const auto size : sizes) whole += size;
    EXPECT_LE(larger_side(graph, side), whole * 6 / 10 + 4);
    EXPECT_EQ(bisect(graph), side) << "the same again";
  }
}

}  // namespace
}  // namespace relmap::route
