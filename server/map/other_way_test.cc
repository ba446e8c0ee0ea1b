#include "server/map/other_way.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/map/edge_edit.h"
#include "server/map/testing/ridden_drive.h"

namespace relmap::map {
namespace {

using testing::HasSubstr;

// The closure of a frame that was proposed.
storage::Edge loop_of(const storage::Graph& graph, FrameId query) {
  for (const storage::Edge& edge : graph.hot(query)->edges)
    if (edge.kind == storage::EdgeKind::kLoop) return edge;
  throw std::runtime_error("no closure of " + query.to_string());
}

OtherWay other_way_of(const storage::Graph& graph, FrameId query) {
  return other_way(graph, loop_of(graph, query)).or_throw();
}

// Two laps without a ride.
class OtherWayTest : public testing::Test {
 protected:
  OtherWayTest() {
    sim::PointsWorldOptions options;
    options.frames_per_lap = 60;
    options.frames = 80;
    world_.emplace(options);
    drive_.drive(*world_, options.frames, {});
  }
  void propose(std::uint32_t query, double metres, bool accept = false) {
    auto proposal = *true_closure(drive_.map(), *world_, query, 60);
    proposal.T_match_query.t.z() += metres;
    proposal.verification = storage::Verification::kStereo;
    drive_.apply(proposal);
    if (accept) drive_.apply(edit_record(loop_of(drive_.map(), frame(query)).id, EdgeAction::kAccept, ""));
  }
  static FrameId frame(std::uint32_t i) { return {kDriveSession, i}; }

  std::optional<sim::PointsWorld> world_;
  PointsDrive drive_;
};

TEST_F(OtherWayTest, OfATrueClosureAgreesAndDoesNotUseIt) {
  propose(70, 0, /*accept=*/true);
  const OtherWay found = other_way_of(drive_.map(), frame(70));
  EXPECT_EQ(found.verdict, Reason::OK) << found.message;
  ASSERT_TRUE(found.way);
  EXPECT_EQ(found.way->edges, 60u) << "all the way round, though the closure is in force";
  EXPECT_LT(found.sigmas_apart, 4.1);
  EXPECT_GT(found.sigmas_apart, 0);
}

TEST_F(OtherWayTest, OfAWrongClosureContradictsItWhetherItIsInForceOrNot) {
  for (const bool accept : {false, true}) {
    const std::uint32_t query = accept ? 75 : 70;
    propose(query, 3, accept);
    const OtherWay found = other_way_of(drive_.map(), frame(query));
    EXPECT_EQ(found.verdict, Reason::CONTRADICTS_MOTION) << found.message;
    EXPECT_GT(found.metres_apart, 2);
    EXPECT_GT(found.sigmas_apart, 4.1);
    EXPECT_THAT(found.message, HasSubstr("standard deviations"));
  }
}

TEST_F(OtherWayTest, MayGoOverOtherClosures) {
  propose(66, 0, true);
  propose(70, 0);
  const OtherWay found = other_way_of(drive_.map(), frame(70));
  EXPECT_EQ(found.verdict, Reason::OK) << found.message;
  EXPECT_LT(found.way->edges, 15u);
}

TEST_F(OtherWayTest, ThatIsTooLongSaysNothing) {
  propose(70, 0);
  const OtherWay found = other_way(drive_.map(), loop_of(drive_.map(), frame(70)), route::WorkLimit{5, {}}).or_throw();
  EXPECT_EQ(found.verdict, Reason::OUT_OF_REACH);
  EXPECT_FALSE(found.way);
}

TEST_F(OtherWayTest, EndsWithItsWork) {
  propose(70, 0);
  const route::WorkLimit late{.max_frames = 1000, .proceed = [](std::size_t) -> Status {
                                return {Reason::DEADLINE, ""};
                              }};
  EXPECT_EQ(other_way(drive_.map(), loop_of(drive_.map(), frame(70)), late).reason(), Reason::DEADLINE);
}

TEST_F(OtherWayTest, WithoutMetresIsNotCompared) {
  propose(70, 0);
  storage::Edge closure = loop_of(drive_.map(), frame(70));
  closure.verification = storage::Verification::kEpipolar;
  EXPECT_EQ(other_way(drive_.map(), closure)->verdict, Reason::NOT_STEREO);
}

TEST(OtherWayOfARide, IsCarriedIfOthersSayItToo) {
  RiddenDrive ridden(kBeyond);
  for (std::uint32_t i = kCircuit; i < kCircuit + kBeyond; ++i) {
    auto proposal = ridden.closure(i);
    proposal.verification = storage::Verification::kStereo;
    ridden.drive().apply(proposal);
  }
  const storage::Edge closure = loop_of(ridden.map(), RiddenDrive::frame(kCircuit + 20));
  ASSERT_EQ(closure.state, storage::EdgeState::kAccepted) << reason_name(closure.reason);
  // The nearest closures lead past the ride, which is compared only without them.
  class Alone final : public storage::ForwardingGraph<storage::Graph> {
   public:
    Alone(const storage::Graph& graph, EdgeId only) : ForwardingGraph(graph), only_(only) {}
    std::shared_ptr<const storage::FrameHot> hot(FrameId id) const override {
      const auto there = ForwardingGraph::hot(id);
      if (!there) return there;
      auto changed = std::make_shared<storage::FrameHot>(*there);
      for (storage::Edge& edge : changed->edges)
        if (edge.kind == storage::EdgeKind::kLoop && edge.id != only_) edge.state = storage::EdgeState::kCandidate;
      return changed;
    }

   private:
    const EdgeId only_;
  };
  const OtherWay found = other_way(Alone(ridden.map(), closure.id), closure).or_throw();
  EXPECT_EQ(found.verdict, Reason::CARRIED) << found.message;
  EXPECT_GT(found.sigmas_apart, 4.1);
}

}  // namespace
}  // namespace relmap::map
