#include "server/place/older_views.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "storage/testing/small_graph.h"

namespace relmap::place {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

SE3 ahead(double metres) {
  SE3 T;
  T.t.z() = metres;
  return T;
}

std::vector<FrameId> views(const storage::Graph& graph, FrameId match, const SE3& T_match_query) {
  std::vector<FrameId> frames;
  for (const OlderView& view : older_views(graph, match, T_match_query, [](FrameId) { return false; }))
    frames.push_back(view.frame);
  return frames;
}

// Passes 1 .. count over the same 20 m, with a frame each metre. A loop edge joins frame 10 of each pass to frame 10 of
// the pass before.
storage::SmallGraph passes(SessionNumber count) {
  storage::SmallGraph graph;
  std::uint64_t sequence = 0;
  for (SessionNumber pass = 1; pass <= count; ++pass)
    for (std::uint32_t i = 0; i < 20; ++i) {
      graph.frame({pass, i}).journal_sequence = ++sequence;
      if (i > 0) graph.join({pass, i - 1}, {pass, i}, 0, ahead(1));
      if (i == 10 && pass > 1) graph.join({pass - 1, 10}, {pass, 10}, 1).kind = storage::EdgeKind::kLoop;
    }
  return graph;
}

TEST(OlderViews, AreTheNearestFramesOfOlderPassesTheOldestFirst) {
  const storage::SmallGraph graph = passes(3);
  EXPECT_THAT(views(graph, {3, 8}, ahead(0.9)), ElementsAre(FrameId{1, 9}, FrameId{2, 9}));
  EXPECT_THAT(views(graph, {2, 8}, ahead(0)), ElementsAre(FrameId{1, 8}));
  EXPECT_THAT(views(graph, {1, 8}, ahead(0)), IsEmpty());
  EXPECT_THAT(views(graph, {7, 8}, ahead(0)), IsEmpty());
}

TEST(OlderViews, HaveTheirPoseFromTheMap) {
  const auto found = older_views(passes(3), {3, 8}, ahead(0.9), [](FrameId) { return false; });
  ASSERT_EQ(found.size(), 2u);
  for (const OlderView& view : found) EXPECT_NEAR(view.T_frame_query.t.z(), -0.1, 1e-9) << "of frame 9, from 8.9 m";
}

TEST(OlderViews, AreNoMoreThanAFew) { EXPECT_EQ(views(passes(9), {9, 10}, ahead(0)).size(), kMaxOlderViews); }

TEST(OlderViews, AreNearTheQueryAndLookTheSameWay) {
  const storage::SmallGraph graph = passes(2);
  EXPECT_THAT(views(graph, {2, 10}, ahead(-30)), IsEmpty()) << "no pass was there";
  SE3 turned;
  turned.R = SE3::exp((Vector6() << 0, 0, 0, 0, 2, 0).finished()).R;
  EXPECT_THAT(views(graph, {2, 10}, turned), IsEmpty()) << "no pass looked that way";
}

TEST(OlderViews, AreNeitherLaterFramesNorFramesLeftOut) {
  // Robots 1 and 2 drive in convoy, and a loop edge joins their frames 10. Then frame 14 of robot 1 recognises frame 13
  // of robot 2, from which the walk up leads back to robot 1 itself.
  storage::SmallGraph graph;
  for (std::uint32_t i = 0; i < 16; ++i)
    for (SessionNumber robot = 1; robot <= 2; ++robot) {
      graph.frame({robot, i}).journal_sequence = 2 * i + robot;
      if (i > 0) graph.join({robot, i - 1}, {robot, i}, 0, ahead(1));
      if (i == 10 && robot == 2) graph.join({1, 10}, {2, 10}, 1).kind = storage::EdgeKind::kLoop;
    }
  for (const FrameId frame : views(graph, {2, 13}, ahead(1)))
    EXPECT_LT(graph.hot(frame)->journal_sequence, graph.hot({2, 13})->journal_sequence);
  EXPECT_THAT(older_views(graph, {2, 13}, ahead(1), [](FrameId frame) { return frame.session == 1; }), IsEmpty());
}

TEST(OlderViews, IncludeOneOfEachRobotThatPassedTogether) {
  storage::SmallGraph graph;
  std::uint64_t sequence = 0;
  for (std::uint32_t i = 0; i < 20; ++i)
    for (SessionNumber robot = 1; robot <= 2; ++robot) {
      graph.frame({robot, i}).journal_sequence = ++sequence;
      if (i > 0) graph.join({robot, i - 1}, {robot, i}, 0, ahead(1));
    }
  for (std::uint32_t i = 0; i < 20; ++i) {
    graph.frame({3, i}).journal_sequence = ++sequence;
    if (i > 0) graph.join({3, i - 1}, {3, i}, 0, ahead(1));
    if (i == 10) graph.join({1, 10}, {3, 10}, 1).kind = graph.join({2, 10}, {3, 10}, 2).kind = storage::EdgeKind::kLoop;
  }
  EXPECT_THAT(views(graph, {3, 11}, ahead(0)), ElementsAre(FrameId{1, 11}, FrameId{2, 11}));
}

TEST(OlderViews, IncludeEarlierPassesOfTheSameSession) {
  // Sixty frames, and then sixty from where the session began.
  storage::SmallGraph graph;
  for (std::uint32_t i = 0; i < 120; ++i) {
    graph.frame({1, i}).journal_sequence = i + 1;
    if (i > 0) graph.join({1, i - 1}, {1, i}, 0, ahead(i == 60 ? -59 : 1));
  }
  graph.join({1, 10}, {1, 70}, 1).kind = storage::EdgeKind::kLoop;
  EXPECT_THAT(views(graph, {1, 72}, ahead(0)), ElementsAre(FrameId{1, 12}));
}

}  // namespace
}  // namespace relmap::place
