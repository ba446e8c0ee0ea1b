#include "storage/graph/observers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "storage/testing/small_graph.h"

namespace relmap::storage {
namespace {

std::vector<FrameId> pass(std::uint32_t first, std::uint32_t count, SessionNumber session = 1) {
  std::vector<FrameId> frames;
  for (std::uint32_t i = 0; i < count; ++i) frames.push_back({session, first + i});
  return frames;
}
std::vector<FrameId> operator+(std::vector<FrameId> l, const std::vector<FrameId>& r) {
  l.insert(l.end(), r.begin(), r.end());
  return l;
}

TEST(Observers, ALandmarkIsFixedByThirtyTwoFramesOrAFifthPass) {
  EXPECT_FALSE(is_fixed({}));
  EXPECT_FALSE(is_fixed(pass(0, 31)));
  EXPECT_TRUE(is_fixed(pass(0, 32)));
  const auto four = pass(0, 3) + pass(100, 3) + pass(200, 3) + pass(7, 3, 2);
  EXPECT_FALSE(is_fixed(four));
  EXPECT_TRUE(is_fixed(four + pass(300, 1)));
  EXPECT_FALSE(is_fixed(four + pass(203, 1))) << "the third pass goes on";
}

TEST(Observers, RobotsThatPassTogetherAreTwoPasses) {
  std::vector<FrameId> frames;
  for (std::uint32_t i = 0; i < 10; ++i) {
    frames.push_back({1, i});
    frames.push_back({2, 500 + i});
  }
  EXPECT_FALSE(is_fixed(frames));
}

TEST(Observers, AreKeptInTheOrderOfArrivalUntilTheListIsFull) {
  SmallGraph graph;
  std::vector<FrameId> arrivals;
  for (std::uint32_t i = 0; i < 8; ++i)
    for (const std::uint32_t base : {0U, 100U, 200U, 300U, 400U, 500U}) arrivals.push_back({1, base + i});
  for (std::size_t k = 0; k < arrivals.size(); ++k) graph.frame(arrivals[k]).journal_sequence = 1000 - k;
  std::vector<FrameId> kept = arrivals + arrivals;
  kept.push_back({3, 3});  // lost
  keep_first_observers(graph, &kept);
  EXPECT_THAT(
      kept, testing::ElementsAre(FrameId{1, 507}, FrameId{1, 407}, FrameId{1, 307}, FrameId{1, 207}, FrameId{1, 107}));
}

// Twenty passes, each tied to the first, each with a frame that sees the landmark of frame 5; pass 3 is out of reach.
TEST(Observers, AreFoundAnewAmongAllFramesInReach) {
  SmallGraph graph;
  std::uint64_t sequence = 0;
  for (SessionNumber session = 1; session <= 20; ++session)
    for (std::uint32_t i = 0; i < 40; ++i) {
      graph.frame({session, i}).journal_sequence = ++sequence;
      if (i > 0) graph.join({session, i - 1}, {session, i});
      if (i == 10 && session > 1) graph.join({1, 10}, {session, i}, 1).kind = EdgeKind::kLoop;
      graph.warm_frame({session, i});
    }
  const LandmarkId landmark{{1, 5}, 0};
  graph.frame(landmark.base).landmarks.resize(1);
  for (SessionNumber session = 1; session <= 20; ++session) {
    Observation seen;
    seen.landmark = landmark;
    graph.warm_frame({session, session == 3 ? 39U : 12U}).observations.push_back(seen);
  }
  EXPECT_THAT(FirstObservers(graph).of(landmark),
              testing::ElementsAre(FrameId{1, 12}, FrameId{2, 12}, FrameId{4, 12}, FrameId{5, 12}, FrameId{6, 12}));
}

}  // namespace
}  // namespace relmap::storage
