#include "server/map/consistency.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/map/testing/counting_graph.h"
#include "server/place/testing/hand_made_graph.h"

namespace relmap::map {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

SE3 ahead(double metres) { return {Matrix3::Identity(), {0, 0, metres}}; }

// Two sessions along the same street, a frame a metre, the second exactly where the first was.
class Consistency : public ::testing::Test {
 protected:
  static constexpr std::uint32_t kFrames = 40;

  void SetUp() override {
    for (SessionNumber session : {1, 2}) {
      graph_.add_session(session, {300, 160, 120, 0.1, 320, 240});
      for (std::uint32_t i = 0; i < kFrames; ++i) {
        graph_.add_frame({session, i});
        if (i > 0) graph_.add_edge({session, i - 1}, {session, i}, 0, step(session, i));
      }
    }
  }
  virtual SE3 step(SessionNumber, std::uint32_t) const { return ahead(1); }

  // "Session 2's frame `query` is `metres` ahead of session 1's `match`."
  storage::Edge close(std::uint32_t query, std::uint32_t match, double metres,
                      storage::EdgeState state = storage::EdgeState::kAccepted) {
    graph_.add_edge({1, match}, {2, query}, 1, ahead(metres), 1e-4 * Matrix6::Identity());
    storage::Edge& edge = graph_.edit_hot({2, query}).edges.back();
    edge.state = state;
    edge.prior_T_ab = edge.T_ab;
    edge.prior_covariance = edge.covariance;
    return edge;
  }

  place::HandMadeGraph graph_;
};

TEST_F(Consistency, ClosuresWithTheSameTransformAgree) {
  const storage::Edge first = close(5, 5, 0), second = close(9, 8, 1);
  const Neighbourhood near = test_consistency(graph_, second);
  EXPECT_THAT(near.agreeing, ElementsAre(first.id));
  EXPECT_THAT(near.conflicting, IsEmpty());
}

TEST_F(Consistency, AcceptedClosuresWithAnotherTransformConflict) {
  const storage::Edge wrong = close(5, 5, 1), candidate = close(6, 6, 1, storage::EdgeState::kCandidate),
                      closure = close(9, 9, 0);
  const Neighbourhood near = test_consistency(graph_, closure);
  EXPECT_THAT(near.agreeing, IsEmpty());
  EXPECT_THAT(near.conflicting, ElementsAre(wrong.id));
}

TEST_F(Consistency, RemovedClosuresAreListedApart) {
  close(5, 5, 0, storage::EdgeState::kRemoved);
  const Neighbourhood near = test_consistency(graph_, close(9, 9, 0));
  EXPECT_THAT(near.agreeing, IsEmpty());
  EXPECT_EQ(near.taken_out.size(), 1u) << "but that it was taken out";
}

class Standing : public Consistency {
 protected:
  SE3 step(SessionNumber session, std::uint32_t i) const override {
    return session == 2 && i > 5 && i < 10 ? SE3() : ahead(1);
  }
};

TEST_F(Standing, FramesOfAStandingRobotCountAsOneWitness) {
  close(6, 5, 0);
  EXPECT_THAT(test_consistency(graph_, close(9, 5, 0)).agreeing, IsEmpty());
  EXPECT_EQ(test_consistency(graph_, close(11, 7, 0)).agreeing.size(), 2u);
}

TEST_F(Consistency, TheRobotsMotionContradictsAClosureOfItsOwnPast) {
  const auto closure = [&](std::uint32_t query, std::uint32_t match, double metres) {
    storage::Edge edge;
    edge.id = {{1, query}, 1};
    edge.a = {1, match};
    edge.b = {1, query};
    edge.T_ab = edge.prior_T_ab = ahead(metres);
    edge.prior_covariance = 1e-4 * Matrix6::Identity();
    return edge;
  };
  const auto verdict = [&](const storage::Edge& edge) { return test_motion(graph_, edge).verdict; };
  EXPECT_EQ(verdict(closure(30, 10, 20)), MotionVerdict::kAgrees);
  EXPECT_EQ(verdict(closure(30, 10, 20.3)), MotionVerdict::kAgrees) << "odometry drifts by a hundredth";
  EXPECT_EQ(verdict(closure(30, 10, 0)), MotionVerdict::kContradicts);
  EXPECT_EQ(verdict(close(9, 3, 0)), MotionVerdict::kUntested) << "another session's";
  graph_.edit_hot({1, 20}).edges.front().source = MotionSource::kUnsensed;
  EXPECT_EQ(verdict(closure(30, 10, 0)), MotionVerdict::kUntested);
}

// Rides near each other, with closures that lead over the later rides as well: to measure one, the closures of others
// are followed, which lead over others again.
std::size_t reads_of_a_closure_over(std::uint32_t rides) {
  constexpr std::uint32_t kBefore = 20, kApart = 5, kCarriers = 4;
  const std::uint32_t behind = kBefore + rides * kApart;
  place::HandMadeGraph graph;
  graph.add_session(1, {300, 160, 120, 0.1, 320, 240});
  for (std::uint32_t i = 0; i < behind + 20; ++i) {
    graph.add_frame({1, i});
    if (i > 0) graph.add_edge({1, i - 1}, {1, i}, 0, ahead(1));
  }
  for (std::uint32_t ride = 0; ride < rides; ++ride)
    for (std::uint32_t i = 0; i < kCarriers; ++i) {
      const std::uint32_t at = kBefore + ride * kApart, match = at - 1 - i, query = behind + i;
      const auto ordinal = static_cast<std::uint32_t>(graph.hot({1, query})->edges.size());
      graph.add_edge({1, match}, {1, query}, ordinal, ahead(query - match), 1e-4 * Matrix6::Identity());
      storage::Edge& carrier = graph.edit_hot({1, query}).edges.back();
      carrier.prior_T_ab = carrier.T_ab;
      carrier.prior_covariance = carrier.covariance;
      carrier.carried = {1, at - 1, at};
      graph.edit_hot({1, at}).edges.front().carried_by.push_back(carrier.id);
    }
  storage::Edge closure;
  closure.id = {{1, behind + 15}, 1};
  closure.a = {1, 5};
  closure.b = {1, behind + 15};
  closure.T_ab = ahead(behind + 10);
  closure.prior_covariance = 1e-4 * Matrix6::Identity();
  const CountingGraph counting(graph);
  test_motion(counting, closure);
  test_consistency(counting, closure);
  return counting.hot_reads();
}

TEST(ConsistencyAcrossRides, EachRideIsMeasuredOnceHoweverManyLieNearEachOther) {
  const std::size_t one = reads_of_a_closure_over(1), four = reads_of_a_closure_over(4),
                    eight = reads_of_a_closure_over(8);
  EXPECT_LT(four, 4 * one);
  EXPECT_LT(eight, 2 * four);
}

}  // namespace
}  // namespace relmap::map
