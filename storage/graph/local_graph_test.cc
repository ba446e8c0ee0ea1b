#include "storage/graph/local_graph.h"

#include <gtest/gtest.h>

#include <map>
#include <random>

#include "storage/testing/small_graph.h"

namespace relmap::storage {
namespace {

// Sessions that grow side by side, loop edges from newer frames to older ones, some of them not in force.
class RandomSessions {
 public:
  explicit RandomSessions(unsigned seed) : random_(seed) {}

  void grow(std::uint32_t frames, double loops) {
    for (std::uint32_t n = 0; n < frames; ++n) {
      const auto session = static_cast<SessionNumber>(1 + below(3));
      const FrameId id{session, next_[session]++};
      graph.frame(id);
      if (id.index > 0) graph.join({session, id.index - 1}, id);
      for (std::uint32_t ordinal = 1; !ids.empty() && std::bernoulli_distribution(loops)(random_); ++ordinal) {
        Edge& edge = graph.join(ids[below(ids.size())], id, ordinal);
        edge.kind = EdgeKind::kLoop;
        if (below(4) == 0) edge.state = EdgeState::kCandidate;
        if (below(4) == 0) edge.carries = false;
      }
      ids.push_back(id);
    }
  }
  std::size_t below(std::size_t n) { return random_() % n; }

  SmallGraph graph;
  std::vector<FrameId> ids;

 private:
  std::mt19937 random_;
  std::map<SessionNumber, std::uint32_t> next_;
};

// Steps up by the definition: along the motion, and to the older ends of the frame's own loop edges.
std::vector<FrameId> steps_up(const Graph& graph, FrameId id, const std::vector<FrameId>& all) {
  std::vector<FrameId> up;
  for (const Edge& edge : graph.hot(id)->edges)
    if (edge.in_graph()) up.push_back(edge.a);
  for (const FrameId other : all)
    for (const Edge& edge : graph.hot(other)->edges)
      if (edge.in_graph() && edge.a == id && edge.id.ordinal == 0) up.push_back(other);
  return up;
}

std::map<FrameId, std::uint32_t> depths_up(const Graph& graph, FrameId root, const std::vector<FrameId>& all) {
  std::map<FrameId, std::uint32_t> depth{{root, 0}};
  std::vector<FrameId> open{root};
  for (std::size_t k = 0; k < open.size(); ++k) {
    if (depth[open[k]] == kWalkDepth) continue;
    for (const FrameId next : steps_up(graph, open[k], all))
      if (depth.emplace(next, depth[open[k]] + 1).second) open.push_back(next);
  }
  return depth;
}

// The frames of a path, its steps checked against the graph.
std::vector<FrameId> frames_of(LocalGraph& local, FrameId base, const std::vector<LocalStep>& steps) {
  std::vector<FrameId> frames{base};
  for (const LocalStep& step : steps) {
    const Edge& edge = *local.edges[static_cast<std::size_t>(step.edge)].record;
    EXPECT_TRUE(edge.in_graph());
    EXPECT_EQ(step.forward ? edge.a : edge.b, frames.back());
    frames.push_back(step.forward ? edge.b : edge.a);
    EXPECT_EQ(local.frames[static_cast<std::size_t>(step.frame)].id, frames.back());
  }
  return frames;
}

TEST(LocalGraph, APathGoesUpAndDownByTheFewestEdges) {
  for (unsigned seed = 0; seed < 12; ++seed) {
    RandomSessions world(seed);
    world.grow(90, 0.15);
    LocalGraph local(world.graph);
    std::map<FrameId, std::map<FrameId, std::uint32_t>> up;
    for (const FrameId id : world.ids) up[id] = depths_up(world.graph, id, world.ids);
    std::vector<LocalStep> steps;
    std::size_t reached = 0, beyond = 0;
    for (const FrameId base : world.ids)
      for (const FrameId observer : world.ids) {
        std::uint32_t min_edges = ~0U, turn = 0;  // `turn`: how far from the observer the path turns
        for (const auto& [frame, from_observer] : up[observer])
          if (const auto from_base = up[base].find(frame); from_base != up[base].end()) {
            const std::uint32_t edges = from_base->second + from_observer;
            if (edges < min_edges || (edges == min_edges && from_observer < turn)) turn = from_observer;
            min_edges = std::min(min_edges, edges);
          }
        const bool found = local.path(local.frame(base), local.frame(observer), &steps);
        ASSERT_EQ(found, min_edges != ~0U) << base.to_string() << " " << observer.to_string();
        if (!found) {
          ++beyond;
          continue;
        }
        ++reached;
        ASSERT_EQ(steps.size(), min_edges);
        const std::vector<FrameId> frames = frames_of(local, base, steps);
        EXPECT_EQ(frames.back(), observer);
        EXPECT_TRUE(up[observer].contains(frames[frames.size() - 1 - turn]));
        EXPECT_TRUE(up[base].contains(frames[frames.size() - 1 - turn]));
      }
    EXPECT_GT(reached, 1000U);
    EXPECT_GT(beyond, 10U);
  }
}

TEST(LocalGraph, LaterFramesDoNotChangePaths) {
  RandomSessions world(7);
  world.grow(60, 0.2);
  const std::vector<FrameId> old = world.ids;
  const auto paths = [&] {
    LocalGraph local(world.graph);
    std::vector<std::vector<FrameId>> found;
    std::vector<LocalStep> steps;
    for (const FrameId base : old)
      for (const FrameId observer : old) {
        if (local.path(local.frame(base), local.frame(observer), &steps))
          found.push_back(frames_of(local, base, steps));
        else
          found.emplace_back();
      }
    return found;
  };
  const auto before = paths();
  // Frames of a new session, so that no old frame gets a further odometry edge.
  for (std::uint32_t i = 0; i < 200; ++i) {
    const FrameId id{9, i};
    world.graph.frame(id);
    if (i > 0) world.graph.join({9, i - 1}, id);
    world.graph.join(old[world.below(old.size())], id, 1).kind = EdgeKind::kLoop;
  }
  EXPECT_EQ(paths(), before);
}

TEST(LocalGraph, ATreeHoldsThePathToEachObserver) {
  for (unsigned seed = 20; seed < 26; ++seed) {
    RandomSessions world(seed);
    world.grow(80, 0.15);
    LocalGraph local(world.graph);
    std::vector<std::int32_t> observers;
    for (std::size_t k = 0; k < world.ids.size(); k += 2) observers.push_back(local.frame(world.ids[k]));
    for (std::size_t k = 1; k < world.ids.size(); k += 9) {
      const std::int32_t base = local.frame(world.ids[k]);
      std::vector<LocalGraph::TreeNode> nodes(3);  // of another tree: it appends
      std::vector<std::int32_t> ends;
      local.path_tree(base, observers, &nodes, &ends);
      ASSERT_EQ(ends.size(), observers.size());
      const std::vector<LocalGraph::TreeNode> tree(nodes.begin() + 3, nodes.end());
      std::vector<char> needed(tree.size(), 0);
      std::vector<LocalStep> steps;
      for (std::size_t o = 0; o < observers.size(); ++o) {
        ASSERT_EQ(ends[o] >= 0, local.path(base, observers[o], &steps));
        if (ends[o] < 0) continue;
        std::int32_t node = ends[o];
        for (std::size_t step = steps.size(); step-- > 0; node = tree[static_cast<std::size_t>(node)].parent) {
          const auto& at = tree[static_cast<std::size_t>(node)];
          needed[static_cast<std::size_t>(node)] = 1;
          EXPECT_EQ(at.frame, steps[step].frame);
          EXPECT_EQ(at.edge, steps[step].edge);
          EXPECT_EQ(at.forward, steps[step].forward);
          EXPECT_LT(at.parent, node);
        }
        EXPECT_EQ(node, 0);
      }
      for (std::size_t n = 1; n < tree.size(); ++n) EXPECT_TRUE(needed[n]);
    }
  }
}

TEST(LocalGraph, FramesFurtherThanThirtyEdgesAreOutOfReach) {
  const SmallGraph graph = chain_of(100);
  LocalGraph local(graph);
  std::vector<LocalStep> steps;
  EXPECT_TRUE(local.path(local.frame({1, 20}), local.frame({1, 50}), &steps));
  EXPECT_EQ(steps.size(), kPathDepth);
  EXPECT_FALSE(local.path(local.frame({1, 20}), local.frame({1, 51}), &steps));
  EXPECT_TRUE(local.path(local.frame({1, 20}), local.frame({1, 20}), &steps));
  EXPECT_TRUE(steps.empty());
}

TEST(LocalGraph, APlacePassedOftenIsOneLoopEdgeAwayFromEachPass) {
  // A hundred passes, each tied to frame 10 of the first.
  SmallGraph graph = chain_of(21);
  for (SessionNumber pass = 2; pass <= 100; ++pass) {
    graph.frame({pass, 0});
    for (std::uint32_t i = 1; i < 21; ++i) graph.join({pass, i - 1}, {pass, i});
    graph.join({1, 10}, {pass, 10}, 1).kind = EdgeKind::kLoop;
  }
  LocalGraph local(graph);
  std::vector<LocalStep> steps;
  EXPECT_TRUE(local.path(local.frame({1, 8}), local.frame({77, 13}), &steps));
  EXPECT_EQ(steps.size(), 6U);
  EXPECT_LE(local.frames.size(), 42U) << "no other pass is looked at";
  EXPECT_TRUE(local.path(local.frame({30, 12}), local.frame({77, 13}), &steps)) << "over the first";
  EXPECT_EQ(steps.size(), 7U);
}

TEST(LocalGraph, OneEdgeMayLieOnTwoPathsFromTheBase) {
  // The far frames of session 4 are in reach over session 1 only, the near ones over the shorter path through session
  // 3.
  SmallGraph graph;
  for (SessionNumber session = 1; session <= 4; ++session) {
    graph.frame({session, 0});
    for (std::uint32_t i = 1; i < 45; ++i) graph.join({session, i - 1}, {session, i});
  }
  for (const auto& [a, b] :
       {std::pair<FrameId, FrameId>{{1, 30}, {2, 5}}, {{1, 37}, {3, 20}}, {{2, 10}, {3, 29}}, {{3, 20}, {4, 20}}})
    graph.join(a, b, 1).kind = EdgeKind::kLoop;
  LocalGraph local(graph);
  std::vector<LocalStep> steps;
  ASSERT_TRUE(local.path(local.frame({2, 10}), local.frame({4, 24}), &steps));
  EXPECT_EQ(steps.size(), 15U);
  ASSERT_TRUE(local.path(local.frame({2, 10}), local.frame({4, 25}), &steps));
  EXPECT_EQ(steps.size(), 20U);
  const std::int32_t observers[] = {local.frame({4, 24}), local.frame({4, 25})};
  std::vector<LocalGraph::TreeNode> tree;
  std::vector<std::int32_t> ends;
  local.path_tree(local.frame({2, 10}), observers, &tree, &ends);
  std::map<std::int32_t, int> uses;
  for (std::size_t n = 1; n < tree.size(); ++n) ++uses[tree[n].edge];
  const auto twice = std::count_if(uses.begin(), uses.end(), [](const auto& use) { return use.second == 2; });
  EXPECT_EQ(twice, 5) << "the loop edge to session 4, and four of its motion";
}

TEST(LocalGraph, NearestFramesAreThoseOfTheWalkUp) {
  SmallGraph graph = chain_of(21);
  graph.frame({2, 0});
  for (std::uint32_t i = 1; i < 21; ++i) graph.join({2, i - 1}, {2, i});
  graph.join({1, 5}, {2, 10}, 1).kind = EdgeKind::kLoop;
  LocalGraph local(graph);
  const auto nearest = [&](FrameId root, std::uint32_t count) {
    std::vector<std::int32_t> found;
    local.nearest(local.frame(root), count, &found);
    std::vector<FrameId> ids;
    for (const std::int32_t frame : found) ids.push_back(local.frames[static_cast<std::size_t>(frame)].id);
    return ids;
  };
  EXPECT_EQ(nearest({2, 10}, 6), (std::vector<FrameId>{{2, 10}, {2, 9}, {1, 5}, {2, 11}, {2, 8}, {1, 4}}));
  EXPECT_EQ(nearest({1, 5}, 4), (std::vector<FrameId>{{1, 5}, {1, 4}, {1, 6}, {1, 3}}));
  EXPECT_EQ(nearest({1, 5}, 500).size(), 21U);
}

TEST(LocalGraph, MayBeEmptiedAndUsedAgain) {
  RandomSessions world(3);
  world.grow(60, 0.2);
  LocalGraph again(world.graph);
  std::vector<LocalStep> first, second;
  for (const FrameId base : world.ids) {
    LocalGraph fresh(world.graph);
    again.clear();
    for (const FrameId observer : world.ids) {
      const bool reached = again.path(again.frame(base), again.frame(observer), &first);
      ASSERT_EQ(fresh.path(fresh.frame(base), fresh.frame(observer), &second), reached);
      if (reached) {
        EXPECT_EQ(frames_of(again, base, first), frames_of(fresh, base, second));
      }
    }
  }
}

}  // namespace
}  // namespace relmap::storage
