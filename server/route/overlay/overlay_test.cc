#include "server/route/overlay/overlay.h"

#include <gtest/gtest.h>

#include <random>

#include "server/route/dijkstra.h"
#include "server/route/drawn_map.h"
#include "server/route/overlay/street_grid.h"

namespace relmap {
namespace {

const std::vector<RouteWeights> kMetrics{kByDistance, kByTime, kByTimeStandingToo, {1, 0.5, 0.2, 30}};

// The overlay's cost is Dijkstra's, and its hops are a way of that cost through the graph.
void expect_as_dijkstra(const Overlay& overlay, const Graph& graph, std::size_t metric, FrameId from, FrameId to) {
  const std::vector<FrameId> starts{from}, goals{to};
  const auto expected = find_route(graph, starts, goals, RouteOptions{.weights = overlay.metrics()[metric]});
  auto found = find_route(overlay, graph, metric, starts, goals);
  ASSERT_EQ(found.ok(), expected.ok()) << from.to_string() << " to " << to.to_string();
  if (!expected.ok()) {
    EXPECT_EQ(found.reason(), expected.reason());
    return;
  }
  EXPECT_NEAR(found->cost, expected->cost, 1e-9 * expected->cost);
  ASSERT_TRUE(unpack(overlay, graph, metric, *found).ok());
  FrameId at = from;
  for (const Hop& hop : found->hops) {
    EXPECT_EQ(hop.from, at);
    at = hop.to;
    if (hop.cell != CellTree::kNone) {
      EXPECT_EQ(chunk_id(hop.from), chunk_id(hop.to));
    }
  }
  EXPECT_EQ(at, to);
}

TEST(Overlay, FindsWhatDijkstraFinds) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    StreetGridOptions options;
    options.seed = seed;
    options.robots = 6;
    options.frames_a_robot = 3000;
    options.crossings = 8;
    options.oneway_share = 0.3;
    const StreetGrid grid(options);
    Overlay overlay(kMetrics);
    overlay.build(grid);
    std::mt19937_64 random(seed);
    for (int query = 0; query < 200; ++query)
      expect_as_dijkstra(overlay, grid, random() % kMetrics.size(), grid.random_frame(random),
                         grid.random_frame(random));
  }
}

}  // namespace
}  // namespace relmap
