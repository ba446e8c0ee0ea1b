#include "server/route/overlay/route_search.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <random>
#include <vector>

#include "server/route/testing/live_town.h"

namespace relmap::route {
namespace {

using ::testing::HasSubstr;

class RouteSearchTest : public ::testing::Test {
 protected:
  RouteSearchTest() {
    town_.drive(600);
    index_->start();
    EXPECT_TRUE(index_->wait_current(std::chrono::steady_clock::now() + std::chrono::minutes(1)));
    map_ = index_->snapshot();
  }

  Result<RouteAnswer> search(FrameId from, FrameId to, const RouteOptions& options = {}, std::uint64_t near_steps = 0,
                             const WorkLimit& work = {}) const {
    return search_route(map_, {&from, 1}, {&to, 1}, options, near_steps, work);
  }
  Result<Route> dijkstra(FrameId from, FrameId to, const RouteOptions& options = {}) const {
    return find_route(*map_.view, {&from, 1}, {&to, 1}, options);
  }

  LiveTown town_;
  const std::unique_ptr<RouteIndex> index_ = town_.index();
  RouteIndex::Snapshot map_;
};

TEST_F(RouteSearchTest, CellsAnswerAsDijkstraDoes) {
  std::mt19937_64 random(3);
  for (int i = 0; i < 50; ++i) {
    const FrameId from = town_.random_frame(random), to = town_.random_frame(random);
    const auto answer = search(from, to);
    const auto expected = dijkstra(from, to);
    ASSERT_EQ(expected.ok(), answer.ok())
        << from.to_string() << " to " << to.to_string() << ": " << answer.status().to_string();
    if (!expected.ok()) {
      EXPECT_EQ(expected.reason(), answer.reason());
      continue;
    }
    EXPECT_NEAR(expected->cost, answer->route.cost, 1e-9 * expected->cost);
    EXPECT_EQ("", answer->frame_by_frame);
    EXPECT_FALSE(answer->near);
  }
}

// Where closures that only bind could give a better route, the search around the start is Dijkstra's.
TEST_F(RouteSearchTest, AShortRouteIsSearchedAgainAroundItsStart) {
  const FrameId from{1, 100}, to{1, 103};
  const auto answer = search(from, to, {}, 50);
  ASSERT_TRUE(answer.ok()) << answer.status().to_string();
  EXPECT_TRUE(answer->near);
  EXPECT_FALSE(answer->no_way_by_edges);
  EXPECT_NEAR(dijkstra(from, to)->cost, answer->route.cost, 1e-9);
  const auto long_way = search(from, {1, 599}, {}, 1);
  ASSERT_TRUE(long_way.ok()) << long_way.status().to_string();
  EXPECT_FALSE(long_way->near);
}

TEST_F(RouteSearchTest, QuestionsThatCellsCannotAnswerAreSearchedFrameByFrame) {
  const FrameId from{1, 100}, to{1, 300};
  RouteOptions options;
  options.weights = {2, 0, 0, 0};
  const auto other_cost = search(from, to, options);
  ASSERT_TRUE(other_cost.ok()) << other_cost.status().to_string();
  EXPECT_THAT(other_cost->frame_by_frame, HasSubstr("kinds of cost"));
  EXPECT_NEAR(dijkstra(from, to, options)->cost, other_cost->route.cost, 1e-9 * other_cost->route.cost);

  options = {};
  options.filter.supposed.candidates = true;
  const auto supposed = search(from, to, options);
  ASSERT_TRUE(supposed.ok()) << supposed.status().to_string();
  EXPECT_THAT(supposed->frame_by_frame, HasSubstr("supposed"));

  options = {};
  options.filter.against_oneway = true;
  const auto against = search(from, to, options);
  ASSERT_TRUE(against.ok()) << against.status().to_string();
  EXPECT_THAT(against->frame_by_frame, HasSubstr("one-way"));
  EXPECT_NEAR(dijkstra(from, to, options)->cost, against->route.cost, 1e-9 * against->route.cost);

  map_.stale.resize(101);
  const auto stale = search(from, to);
  ASSERT_TRUE(stale.ok()) << stale.status().to_string();
  EXPECT_THAT(stale->frame_by_frame, HasSubstr("tenth of the map"));

  map_.overlay = nullptr;
  map_.missing_because = "the disk is full";
  const auto without = search(from, to);
  ASSERT_TRUE(without.ok()) << without.status().to_string();
  EXPECT_EQ("the disk is full", without->frame_by_frame);
}

// By cells, each search finds what Dijkstra's finds, and so do all of them together.
TEST_F(RouteSearchTest, CellsFindTheAlternativesThatDijkstraFinds) {
  town_.drive(2400);
  ASSERT_TRUE(index_->wait_current(std::chrono::steady_clock::now() + std::chrono::minutes(10)));
  map_ = index_->snapshot();
  std::mt19937_64 random(7);
  RouteIndex::Snapshot without = map_;
  without.overlay = nullptr;
  without.missing_because = "not asked for";
  std::size_t alternatives = 0;
  for (int i = 0; i < 30; ++i) {
    const FrameId from = town_.random_frame(random), to = town_.random_frame(random);
    RouteOptions options;
    options.weights = kTownMetrics[static_cast<std::size_t>(i) % kTownMetrics.size()];
    if (i % 4 == 3) options.filter.avoided.insert(town_.random_frame(random));
    const auto others = [&](const RouteIndex::Snapshot& map) {
      const auto answer = search_route(map, {&from, 1}, {&to, 1}, options, 0, {});
      if (!answer.ok()) return std::vector<Alternative>();
      return search_alternatives(map, {&from, 1}, {&to, 1}, options, 0, *answer, 3, {});
    };
    const auto by_cells = others(map_), by_frames = others(without);
    ASSERT_EQ(by_cells.size(), by_frames.size()) << from.to_string() << " to " << to.to_string();
    for (std::size_t n = 0; n < by_cells.size(); ++n) {
      const Route &one = by_cells[n].route, &other = by_frames[n].route;
      EXPECT_NEAR(one.cost, other.cost, 1e-9 * other.cost);
      EXPECT_NEAR(one.distance_m, other.distance_m, 1e-9 * other.distance_m);
      EXPECT_NEAR(by_cells[n].shared, by_frames[n].shared, 1e-9);
      EXPECT_EQ(one.steps(), other.steps());
    }
    alternatives += by_cells.size();
  }
  EXPECT_GT(alternatives, 20u);
}

TEST_F(RouteSearchTest, AlternativesToAShortRouteAreSearchedAroundItsStart) {
  const FrameId from{1, 100}, to{1, 103};
  const auto answer = search(from, to, {}, 50);
  ASSERT_TRUE(answer.ok() && answer->near);
  for (const Alternative& other :
       search_alternatives(map_, {&from, 1}, {&to, 1}, {}, 50, *answer, 3, {.max_frames = 100'000, .proceed = {}})) {
    EXPECT_LE(other.route.cost, kMaxStretch * answer->route.cost);
    EXPECT_LE(other.route.frames_touched, 4 * 50 * kNearFramesAStep);
  }
}

TEST_F(RouteSearchTest, EndsWithTheStatusOfItsWorkLimit) {
  const WorkLimit stopped{.max_frames = 1'000'000,
                          .proceed = [](std::size_t) { return Status(Reason::DEADLINE, "too late"); }};
  EXPECT_EQ(Reason::DEADLINE, search({1, 0}, {1, 599}, {}, 0, stopped).reason());
}

}  // namespace
}  // namespace relmap::route
