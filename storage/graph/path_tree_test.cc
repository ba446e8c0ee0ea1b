#include "storage/graph/path_tree.h"

#include <gtest/gtest.h>

#include "storage/testing/random_frames.h"
#include "storage/testing/small_graph.h"

namespace relmap::storage {
namespace {

constexpr std::uint32_t kDepth = PathLimits().depth;

std::vector<std::uint32_t> order(const PathTree& tree) {
  std::vector<std::uint32_t> indices;
  for (const PathNode& node : tree.nodes) indices.push_back(node.frame.index);
  return indices;
}

TEST(Neighbours, AreThoseOfAcceptedCarryingEdgesInIncreasingEdgeId) {
  SmallGraph graph = chain_of(10);
  graph.join({1, 2}, {1, 9}, 1);
  graph.join({1, 2}, {1, 8}, 1).state = EdgeState::kCandidate;
  graph.join({1, 2}, {1, 7}, 1).carries = false;
  graph.join({1, 0}, {1, 2}, 3);
  const auto found = neighbours(graph, {1, 2}, *graph.hot({1, 2}));
  ASSERT_EQ(found.size(), 4u);
  EXPECT_EQ(found[0].edge, (EdgeId{{1, 2}, 0}));
  EXPECT_EQ(found[0].frame, (FrameId{1, 1}));
  EXPECT_FALSE(found[0].forward);
  EXPECT_EQ(found[1].edge, (EdgeId{{1, 2}, 3}));
  EXPECT_EQ(found[2].edge, (EdgeId{{1, 3}, 0}));
  EXPECT_TRUE(found[2].forward);
  EXPECT_EQ(found[3].frame, (FrameId{1, 9}));
}

TEST(PathTree, IsBreadthFirstInIncreasingEdgeIdAndTheFirstDiscoveryWins) {
  SmallGraph graph = chain_of(6);
  graph.join({1, 1}, {1, 5}, 1);  // 0-1-5 is as long as 0-1-2, and 4 is reached from 3 or 5
  const PathTree tree = build_path_tree(graph, {1, 0});
  EXPECT_EQ(order(tree), (std::vector<std::uint32_t>{0, 1, 2, 5, 3, 4}));
  EXPECT_EQ(tree.nodes[static_cast<std::size_t>(tree.find({1, 4})->parent)].frame, (FrameId{1, 5}));
  EXPECT_FALSE(tree.cut);
  EXPECT_EQ(tree.find({1, 9}), nullptr);
  for (std::size_t i = 1; i < tree.nodes.size(); ++i) EXPECT_LT(tree.nodes[i].parent, static_cast<std::int32_t>(i));
}

TEST(PathTree, IsCutAtItsDepthAndAtItsNumberOfFrames) {
  const SmallGraph graph = chain_of(100);
  const PathTree deep = build_path_tree(graph, {1, 0});
  EXPECT_EQ(deep.nodes.size(), kDepth + 1);
  EXPECT_TRUE(deep.cut);
  const PathTree few = build_path_tree(graph, {1, 50}, {kDepth, 7});
  EXPECT_EQ(few.nodes.size(), 7u);
  EXPECT_TRUE(few.cut);
  EXPECT_FALSE(build_path_tree(chain_of(kDepth + 1), {1, 0}).cut);
  EXPECT_FALSE(build_path_tree(chain_of(7), {1, 0}, {kDepth, 7}).cut);
}

TEST(PathTree, StopsAtTheFrameLookedForWithTheSamePathToIt) {
  SmallGraph graph = chain_of(20);
  graph.join({1, 3}, {1, 15}, 1);
  const PathTree whole = build_path_tree(graph, {1, 0});
  PathLimits limits;
  limits.until = {1, 16};
  const PathTree part = build_path_tree(graph, {1, 0}, limits);
  ASSERT_TRUE(part.find({1, 16}));
  EXPECT_LT(part.nodes.size(), whole.nodes.size());
  EXPECT_EQ(part.nodes.back().frame, limits.until);
  for (std::size_t i = 0; i < part.nodes.size(); ++i) EXPECT_EQ(part.nodes[i].frame, whole.nodes[i].frame);
}

TEST(PathTree, IsEmptyForAFrameThatDoesNotExist) { EXPECT_TRUE(build_path_tree(chain_of(3), {2, 0}).nodes.empty()); }

TEST(PathTree, PosesCompoundTheEdgesInBothDirections) {
  RandomFrames random(4);
  SmallGraph graph;
  const SE3 T_01 = random.transform(), T_12 = random.transform();
  graph.frame({1, 0});
  graph.join({1, 0}, {1, 1}, 0, T_01);
  graph.join({1, 1}, {1, 2}, 0, T_12);
  const auto check = [&](std::uint32_t root, std::uint32_t node, const SE3& expected) {
    const PathTree tree = build_path_tree(graph, {1, root});
    const SE3 T = poses_along(graph, tree)[tree.index.at({1, node})];
    EXPECT_LT((T.inverse() * expected).log().norm(), 1e-12);
  };
  check(0, 2, T_01 * T_12);
  check(2, 0, (T_01 * T_12).inverse());
  check(1, 0, T_01.inverse());
}

}  // namespace
}  // namespace relmap::storage
