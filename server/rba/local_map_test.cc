#include "server/rba/local_map.h"

#include <gtest/gtest.h>

#include "storage/binding.h"
#include "storage/path_tree.h"
#include "tests/simulated_drive.h"

namespace relmap::rba {
namespace {

// A circle of 60 frames driven one and a half times: loop edges, claims, and bindings.
const SimulatedDrive& looped() {
  static SimulatedDrive* drive = [] {
    sim::PointsWorldOptions options;
    options.frames = 90;
    options.frames_per_lap = 60;
    auto* made = new SimulatedDrive(options, RbaOptions());
    made->drive();
    return made;
  }();
  return *drive;
}
const Graph& graph() { return const_cast<SimulatedDrive&>(looped()).map(); }

TEST(LocalMap, PathsAreThoseOfTheGraph) {
  LocalMap local(graph());
  std::vector<LocalMap::TreeNode> tree;
  for (std::uint32_t root = 0; root < looped().driven(); root += 3) {
    const PathTree expected = build_path_tree(graph(), looped().frame(root));
    for (std::uint32_t target = 0; target < looped().driven(); target += 7) {
      const std::int32_t targets[] = {local.frame(looped().frame(target)), local.frame(looped().frame(root))};
      tree.clear();
      local.path_tree(targets[1], targets, &tree);
      // Everything in the cut tree lies on the way, and is as in the whole one.
      const PathNode* node = expected.find(looped().frame(target));
      ASSERT_EQ(tree.size(), node == nullptr ? 1 : node->depth + 1) << root << " " << target;
      for (std::size_t n = tree.size(); n-- > 1;) {
        EXPECT_EQ(local.frames[tree[n].frame].id, node->frame);
        EXPECT_EQ(local.edges[tree[n].edge].id, node->edge);
        EXPECT_EQ(tree[n].forward, node->forward);
        EXPECT_EQ(tree[n].parent, static_cast<std::int32_t>(n) - 1);
        node = &expected.nodes[static_cast<std::size_t>(node->parent)];
      }
    }
  }
}

TEST(LocalMap, TreesToSeveralFramesHoldEachPathOnce) {
  LocalMap local(graph());
  const PathTree expected = build_path_tree(graph(), looped().frame(70));
  std::vector<std::int32_t> targets;
  for (std::uint32_t i = 55; i < 90; i += 2) targets.push_back(local.frame(looped().frame(i)));
  std::vector<LocalMap::TreeNode> tree;
  local.path_tree(local.frame(looped().frame(70)), targets, &tree);
  for (std::size_t n = 1; n < tree.size(); ++n) {
    const PathNode* node = expected.find(local.frames[tree[n].frame].id);
    ASSERT_NE(node, nullptr);
    EXPECT_EQ(local.edges[tree[n].edge].id, node->edge);
    EXPECT_EQ(local.frames[tree[tree[n].parent].frame].id,
              expected.nodes[static_cast<std::size_t>(node->parent)].frame);
    EXPECT_LT(tree[n].parent, static_cast<std::int32_t>(n));
  }
  for (const std::int32_t target : targets)
    EXPECT_EQ(std::count_if(tree.begin(), tree.end(), [&](const auto& n) { return n.frame == target; }), 1);
}

TEST(LocalMap, ObservationsMeanTheLandmarksInForce) {
  LocalMap local(graph());
  std::size_t aliases = 0;
  for (std::uint32_t i = 0; i < looped().driven(); ++i) {
    const std::int32_t frame = local.frame(looped().frame(i));
    local.load_observations(frame);
    const auto warm = graph().warm(looped().frame(i));
    ASSERT_EQ(local.view(frame).end - local.view(frame).first, static_cast<std::int32_t>(warm->observations.size()));
    for (std::size_t k = 0; k < warm->observations.size(); ++k) {
      const LocalObservation& seen = local.observations[static_cast<std::size_t>(local.view(frame).first) + k];
      const LandmarkId expected = resolve(graph(), warm->observations[k].landmark);
      EXPECT_EQ(local.landmarks[seen.landmark].id, expected);
      EXPECT_EQ(local.frames[local.landmarks[seen.landmark].base].id, expected.base);
      aliases += expected != warm->observations[k].landmark;
    }
  }
  EXPECT_GT(aliases, 100U);
}

TEST(LocalMap, NearestFramesAreFoundBreadthFirst) {
  LocalMap local(graph());
  std::vector<std::int32_t> frames;
  local.nearest(local.frame(looped().frame(30)), 8, &frames);
  std::vector<FrameId> found;
  for (const std::int32_t frame : frames) found.push_back(local.frames[frame].id);
  const PathTree tree = build_path_tree(graph(), looped().frame(30), {.frames = 8});
  ASSERT_EQ(found.size(), 8U);
  for (std::size_t k = 0; k < 8; ++k) EXPECT_EQ(found[k], tree.nodes[k].frame);
}

TEST(LocalMap, ServesOneRelaxationAfterAnother) {
  LocalMap again(graph());
  for (std::uint32_t i = 0; i < looped().driven(); i += 9) {
    LocalMap fresh(graph());
    again.clear();
    for (LocalMap* local : {&again, &fresh}) {
      std::vector<std::int32_t> frames;
      local->nearest(local->frame(looped().frame(i)), 12, &frames);
      for (const std::int32_t frame : frames) local->load_observations(frame);
    }
    ASSERT_EQ(again.frames.size(), fresh.frames.size());
    for (std::size_t f = 0; f < fresh.frames.size(); ++f) EXPECT_EQ(again.frames[f].id, fresh.frames[f].id);
    ASSERT_EQ(again.edges.size(), fresh.edges.size());
    for (std::size_t e = 0; e < fresh.edges.size(); ++e) EXPECT_EQ(again.edges[e].id, fresh.edges[e].id);
    ASSERT_EQ(again.landmarks.size(), fresh.landmarks.size());
    for (std::size_t l = 0; l < fresh.landmarks.size(); ++l) EXPECT_EQ(again.landmarks[l].id, fresh.landmarks[l].id);
    EXPECT_EQ(again.observations.size(), fresh.observations.size());
  }
}

TEST(LocalMap, FramesThatNeverCameAreNone) {
  LocalMap local(graph());
  EXPECT_EQ(local.frame({1, 100000}), -1);
  EXPECT_EQ(local.frame({7, 0}), -1);
}

}  // namespace
}  // namespace relmap::rba
