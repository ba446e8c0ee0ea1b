#include "storage/graph/binding.h"

#include <gtest/gtest.h>

#include "storage/testing/small_graph.h"

namespace relmap::storage {
namespace {

struct BindingTest : ::testing::Test {
  SmallGraph graph;
  const LandmarkId old{{1, 0}, 0}, middle{{1, 5}, 1}, fresh{{1, 9}, 2};
  const ClosureId first{{1, 5}, 1}, second{{1, 9}, 1}, third{{1, 9}, 2};

  BindingTest() {
    graph.frame(old.base).landmarks.resize(1);
    graph.frame(middle.base).landmarks.resize(2);
    graph.frame(fresh.base).landmarks.resize(3);
    graph.join({1, 0}, {1, 5}, 1);
    graph.join({1, 5}, {1, 9}, 1);
    graph.join({1, 0}, {1, 9}, 2);
    graph.frame(middle.base).landmarks[1].claims = {{old, first}};
    graph.frame(fresh.base).landmarks[2].claims = {{middle, second}, {old, third}};
  }
};

TEST_F(BindingTest, FollowsClaimsToTheirEnd) {
  EXPECT_EQ(resolve(graph, fresh), old);
  EXPECT_EQ(resolve(graph, middle), old);
  EXPECT_EQ(resolve(graph, old), old);
}

TEST_F(BindingTest, RemovingAClosureUndoesExactlyWhatItSaid) {
  graph.frame({1, 5}).edge(first)->state = EdgeState::kRemoved;
  EXPECT_EQ(resolve(graph, middle), middle);
  EXPECT_EQ(resolve(graph, fresh), middle);
  graph.frame({1, 9}).edge(second)->state = EdgeState::kRemoved;
  EXPECT_EQ(resolve(graph, fresh), old);  // by the next claim
  graph.frame({1, 9}).edge(third)->state = EdgeState::kCandidate;
  EXPECT_EQ(resolve(graph, fresh), fresh);
  graph.frame({1, 9}).edge(second)->state = EdgeState::kAccepted;
  graph.frame({1, 5}).edge(first)->state = EdgeState::kAccepted;
  EXPECT_EQ(resolve(graph, fresh), old);
}

TEST_F(BindingTest, ALandmarkThatIsNotNeededMeansNothingWhileTheClosureHolds) {
  graph.frame(middle.base).landmarks[1].claims = {{{}, first}};
  EXPECT_FALSE(resolve(graph, middle).valid());
  EXPECT_FALSE(resolve(graph, fresh).valid());  // a claim says that it is `middle`
  graph.frame({1, 5}).edge(first)->state = EdgeState::kQuarantined;
  EXPECT_EQ(resolve(graph, middle), middle);
  EXPECT_EQ(resolve(graph, fresh), middle);
}

TEST_F(BindingTest, AClosureThatOnlyBindsHoldsWithoutBeingAnEdgeOfTheGraph) {
  graph.frame({1, 5}).edge(first)->carries = false;
  EXPECT_TRUE(closure_holds(graph, first));
  EXPECT_TRUE(closure_holds(graph, {}));
  EXPECT_FALSE(closure_holds(graph, {{1, 5}, 7}));
  EXPECT_EQ(resolve(graph, middle), old);
}

}  // namespace
}  // namespace relmap::storage
