#include "server/route/neighbourhood.h"

#include <gtest/gtest.h>

#include "server/route/testing/drawn_map.h"

namespace relmap::route {
namespace {

class NeighbourhoodTest : public testing::Test {
 protected:
  NeighbourhoodTest()
      : map_(R"(
    A---B---C---D
    .           |
    G-----F-----E
  )") {
    map_.drive("ABCDEFG");
    map_.close("AG");
  }

  std::string names(const Neighbourhood& part) const {
    std::string text;
    for (const NeighbourhoodFrame& frame : part.frames) text += map_.name(frame.frame);
    return text;
  }
  Neighbourhood around(char root, NeighbourhoodLimits limits, std::size_t max_frames = 1000) const {
    return neighbourhood(map_, map_.id(root), limits, {.max_frames = max_frames, .proceed = {}}).or_throw();
  }

  DrawnMap map_;
};

TEST_F(NeighbourhoodTest, HoldsTheFramesWithinSoManyEdges) {
  EXPECT_EQ(names(around('A', {.edges = 0})), "A");
  EXPECT_EQ(names(around('A', {.edges = 1})), "ABG");
  EXPECT_EQ(names(around('A', {.edges = 2})), "ABGCF");
  EXPECT_EQ(names(around('A', {.edges = 30})), "ABGCFDE");
}

TEST_F(NeighbourhoodTest, HoldsTheFramesWithinSoManyMetres) {
  EXPECT_EQ(names(around('A', {.edges = 30, .metres = 4})), "ABG");
  EXPECT_EQ(names(around('A', {.edges = 30, .metres = 3.9})), "AG");
}

TEST_F(NeighbourhoodTest, PosesAreInTheFrameOfTheRoot) {
  for (const NeighbourhoodFrame& frame : around('F', {}).frames)
    EXPECT_TRUE(frame.T_root_frame.t.isApprox(map_.position(map_.name(frame.frame)) - map_.position('F'), 1e-12));
}

TEST_F(NeighbourhoodTest, EdgesAreThoseWithBothEndsInside) {
  EXPECT_EQ(around('A', {.edges = 1}).edges.size(), 2u);
  EXPECT_EQ(around('A', {.edges = 30}).edges.size(), 7u);  // that between D and E is inside, though on no path
  map_.set_state(around('A', {.edges = 1}).edges[1], storage::EdgeState::kRemoved);
  EXPECT_EQ(around('A', {.edges = 30}).edges.size(), 6u);
}

TEST_F(NeighbourhoodTest, SaysWhetherItWasCut) {
  EXPECT_FALSE(around('A', {.edges = 2}).cut);
  EXPECT_TRUE(around('A', {.edges = 30}, 3).cut);
  EXPECT_EQ(around('A', {.edges = 30}, 3).frames.size(), 3u);
  EXPECT_EQ(neighbourhood(map_, {5, 5}, {}, {}).reason(), Reason::NO_SUCH_FRAME);
}

}  // namespace
}  // namespace relmap::route
