#include "server/map/way_around.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/map/carried_stretch.h"
#include "server/map/consistency.h"
#include "server/map/deletion.h"
#include "server/map/derived.h"
#include "server/map/stops.h"
#include "server/map/testing/ridden_drive.h"
#include "server/place/testing/hand_made_graph.h"
#include "server/route/overlay/route_search.h"

namespace relmap::map {
namespace {

using ::testing::IsEmpty;

constexpr std::uint32_t kJoined = 30;  // the last frame of the rider that is joined to the guide before it boards

// A rider that a guide went before, joined to it from frame 20 to kJoined.
class GuidedRide : public RiddenDrive {
 public:
  explicit GuidedRide(double stood_s = 20, std::set<std::uint32_t> halts = {})
      : RiddenDrive(kBeyond, stood_s, std::move(halts), true) {
    for (std::uint32_t i = kJoined - 10; i <= kJoined; ++i) propose(closure_with_guide(i));
    EXPECT_EQ(closure_of(kJoined).state, storage::EdgeState::kAccepted);
  }
  // As a lookup proposes it.
  storage::ClosureProposalRecord looked_up(std::uint32_t i) {
    storage::ClosureProposalRecord proposal = closure_with_guide(i);
    proposal.around = way_around(map(), proposal);
    return proposal;
  }
  // The first closures behind `at`, every one a frame further, until they come into force: how many it took.
  std::uint32_t until_believed(std::uint32_t at) {
    for (std::uint32_t i = at + 1; i <= at + kBeyond; ++i)
      if (propose(looked_up(i)).state == storage::EdgeState::kAccepted) return i - at;
    return 0;
  }
};

TEST(WayAround, LeadsOverWhatOthersDrove) {
  GuidedRide drive;
  const auto around = drive.looked_up(60).around;
  ASSERT_TRUE(around);
  EXPECT_EQ(around->from, RiddenDrive::frame(kJoined));
  EXPECT_LT((around->T.t - drive.T_true(kJoined, 60).t).norm(), 0.1);
  EXPECT_LT(around->covariance.diagonal().maxCoeff(), 0.05);
  EXPECT_GT(around->covariance.diagonal().minCoeff(), 0);
}

// The daemon searches the newest map by its cells.
TEST(WayAround, IsTheSameByCells) {
  GuidedRide drive;
  // The way leads through a whole chunk of the guide.
  const storage::ClosureProposalRecord proposal = drive.closure_with_guide(130);
  ASSERT_GT(storage::chunk_id(proposal.match), storage::chunk_id({kGuideSession, kJoined + storage::kFramesPerChunk}));
  const auto frame_by_frame = way_around(drive.map(), proposal);
  ASSERT_TRUE(frame_by_frame);

  drive.map().publish();
  route::RouteIndex::Snapshot newest{drive.map().view(), nullptr, "there are none yet", {}, {}};
  const auto without_cells = way_around(drive.map(), proposal, [&] { return newest; });
  ASSERT_TRUE(without_cells);
  route::Overlay overlay({route::kByDistance, kWithoutStops}, route::CellStore::open_temporary().or_throw());
  overlay.build(*newest.view);
  newest.overlay = std::make_shared<const route::Overlay>(std::move(overlay));
  for (const route::RouteWeights& weights : {route::kByDistance, kWithoutStops}) {
    const FrameId from = frame_by_frame->from;
    route::RouteOptions options;
    options.weights = weights;
    options.filter.against_oneway = true;
    const auto answer = route::search_route(newest, {&from, 1}, {&proposal.match, 1}, options, 0, {});
    ASSERT_TRUE(answer.ok()) << answer.status().to_string();
    EXPECT_EQ(answer->frame_by_frame, "");
  }
  const auto by_cells = way_around(drive.map(), proposal, [&] { return newest; });
  ASSERT_TRUE(by_cells);
  for (const storage::WayAround& way : {*without_cells, *by_cells}) {
    EXPECT_EQ(way.from, frame_by_frame->from);
    EXPECT_LT((frame_by_frame->T.inverse() * way.T).log().norm(), 1e-6);
    EXPECT_LT((frame_by_frame->covariance - way.covariance).norm(), 1e-6);
  }
}

TEST(WayAround, IsSoughtBehindAStopOnly) {
  GuidedRide drive;
  EXPECT_FALSE(drive.looked_up(RiddenDrive::kBoards).around) << "no stop lies between";
  EXPECT_TRUE(drive.looked_up(RiddenDrive::kAlights).around);
  EXPECT_FALSE(GuidedRide(0.9 * kMinRideSeconds).looked_up(60).around) << "it stood too shortly to be carried";
  RiddenDrive alone(kBeyond, 20, {}, true);
  EXPECT_FALSE(way_around(alone.map(), alone.closure_with_guide(60))) << "nothing joins it to the map before the stop";
  RiddenDrive own(kBeyond);
  EXPECT_FALSE(way_around(own.map(), own.closure(kCircuit + 1))) << "a closure with its own past needs none";
}

// Sibley et al., 4.7: the robot is carried unnoticed. Here only others have been where it alights.
TEST(WayAround, ClosuresWithOthersFramesTellThatTheRobotWasCarried) {
  GuidedRide drive;
  EXPECT_EQ(drive.propose(drive.looked_up(RiddenDrive::kAlights + 1)).reason, Reason::CONTRADICTS_MOTION)
      << "one place may look like another";
  const std::uint32_t believed = drive.until_believed(RiddenDrive::kAlights + 1);
  ASSERT_GT(believed, 5u);
  for (std::uint32_t i = 1; i <= 1 + believed; ++i) {
    const storage::Edge closure = drive.closure_of(RiddenDrive::kAlights + i);
    EXPECT_EQ(closure.state, storage::EdgeState::kAccepted) << i;
    EXPECT_EQ(closure.reason, Reason::CARRIED) << i;
    EXPECT_EQ(closure.carried.last, RiddenDrive::frame(RiddenDrive::kAlights).index) << i;
  }
  const auto ride = measured_stretch(drive.map(), *storage::find_edge(drive.map(), RiddenDrive::ride()), {});
  ASSERT_TRUE(ride);
  EXPECT_NEAR(ride->T_ab.t.norm(), 0.2 * (RiddenDrive::kRidden + 1), 0.3);
  EXPECT_THAT(derived_differences(drive.map()), IsEmpty());

  for (std::uint32_t i = kJoined - 10; i <= kJoined; ++i)
    EXPECT_EQ(drive.closure_of(i).state, storage::EdgeState::kAccepted)
        << i << ": before the ride they were right, too";

  const std::uint32_t next = RiddenDrive::kAlights + believed + 2;
  EXPECT_FALSE(drive.looked_up(next).around) << "it is joined to the map again";
  const storage::Edge later = drive.propose(drive.looked_up(next));
  EXPECT_EQ(later.state, storage::EdgeState::kAccepted);
  EXPECT_EQ(later.reason, Reason::CONSISTENT);
}

TEST(WayAround, TheRideStaysKnownWhenTheOthersAreDeleted) {
  GuidedRide drive;
  ASSERT_GT(drive.until_believed(RiddenDrive::kAlights), 0u);
  const EdgeId ride = RiddenDrive::ride();
  const auto measured = [&] { return measured_stretch(drive.map(), *storage::find_edge(drive.map(), ride), {}); };
  const auto before = measured();
  ASSERT_TRUE(before);
  drive.drive().apply(storage::SetSessionStateRecord{kGuideSession, storage::SessionState::kDeleting});
  while (const auto removal = next_deletion(*drive.map().session(kGuideSession))) drive.drive().apply(*removal);
  ASSERT_FALSE(drive.map().hot({kGuideSession, 0}));
  const auto after = measured();
  ASSERT_TRUE(after);
  EXPECT_LT((before->T_ab.inverse() * after->T_ab).log().norm(), 0.1);
  EXPECT_THAT(derived_differences(drive.map()), IsEmpty());
}

TEST(WayAround, WhereTheRobotOnlyHaltedTheOdometryIsRight) {
  constexpr std::uint32_t kHalt = 36;
  GuidedRide drive(20, {kHalt});
  const storage::ClosureProposalRecord proposal = drive.looked_up(kHalt + 2);
  ASSERT_TRUE(proposal.around);
  EXPECT_EQ(test_motion(drive.map(), drive.propose(proposal)).verdict, MotionVerdict::kAgrees);
  const storage::Edge second = drive.propose(drive.looked_up(kHalt + 3));
  EXPECT_EQ(second.state, storage::EdgeState::kAccepted);
  EXPECT_EQ(second.reason, Reason::CONSISTENT);
  EXPECT_EQ(second.carried.session, 0u);
}

// A place that only looks like another does not go on for long.
TEST(WayAround, AFalsePlaceBehindAStopIsRefusedByTheOdometry) {
  constexpr std::uint32_t kHalt = 36;
  GuidedRide drive(20, {kHalt});
  for (std::uint32_t i = kHalt + 1; i <= kHalt + 3; ++i) {
    storage::ClosureProposalRecord proposal = drive.closure_with_guide(i);
    proposal.match.index += 30;  // 6 m further on
    proposal.around = way_around(drive.map(), proposal);
    ASSERT_TRUE(proposal.around) << i;
    EXPECT_EQ(drive.propose(proposal).reason, Reason::CONTRADICTS_MOTION) << i;
  }
  const storage::Edge right = drive.propose(drive.looked_up(kHalt + 4));
  EXPECT_EQ(right.state, storage::EdgeState::kAccepted) << "it agrees with those before the stop";
  EXPECT_EQ(right.reason, Reason::CONSISTENT);
}

// When the rider comes back to what the guide saw, nothing measures the guide's way past the ride, so nothing tells
// that the rider was carried. That comes later.
TEST(WayAround, ARideIsNoticedOnceTheMapGetsAWayAroundIt) {
  GuidedRide drive;
  const auto is_known = [&] { return !storage::find_edge(drive.map(), RiddenDrive::ride())->carried_by.empty(); };
  drive.map().edit_hot({kGuideSession, 45}).edges.front().carried_by = {{{kGuideSession, 46}, 1}};
  std::uint32_t i = RiddenDrive::kAlights;
  for (; RiddenDrive::frame(i).index < 64; ++i) {
    const storage::ClosureProposalRecord proposal = drive.looked_up(i);
    EXPECT_FALSE(proposal.around) << i;
    drive.propose(proposal);
  }
  ASSERT_EQ(drive.closure_of(i - 1).state, storage::EdgeState::kAccepted);
  drive.map().edit_hot({kGuideSession, 45}).edges.front().carried_by.clear();

  const std::uint32_t sought = i;
  for (; i < sought + 32 && !is_known(); ++i) {
    const storage::ClosureProposalRecord proposal = drive.looked_up(i);
    EXPECT_TRUE(proposal.around) << i << ": the 64th frame seeks, and those that follow";
    drive.propose(proposal);
  }
  ASSERT_TRUE(is_known());
  EXPECT_EQ(drive.closure_of(sought).reason, Reason::CARRIED);
  EXPECT_EQ(drive.closure_of(60).state, storage::EdgeState::kAccepted) << "those behind the ride were right, too";
  EXPECT_EQ(drive.closure_of(kJoined).state, storage::EdgeState::kAccepted) << "and those before it";
  EXPECT_FALSE(drive.looked_up(i).around) << "it is known";
  EXPECT_THAT(derived_differences(drive.map()), IsEmpty());
}

// A robot of session 1 comes along a street, stops between its frames 3 and 4, and is recognised at frame 5 in the last
// frame of session 2, which drives from 1:1 on. Edges are a metre long.
class HandMadeWay : public ::testing::Test {
 protected:
  HandMadeWay() {
    for (const SessionNumber session : {1u, 2u, 3u}) {
      graph_.add_session(session, place::kStereoCamera);
      for (std::uint32_t i = 0; i < 6; ++i) {
        graph_.add_frame({session, i});
        if (i > 0) graph_.add_edge({session, i - 1}, {session, i}, 0, kMetre);
      }
    }
    stand({1, 4}, 10);
    join({2, 0}, {1, 1}, {});
  }
  void stand(FrameId frame, float seconds) { graph_.edit_hot(frame).edges.front().standing_s = seconds; }
  void join(FrameId a, FrameId b, const SE3& T_ab) {
    const auto ordinal = static_cast<std::uint32_t>(graph_.edit_hot(b).edges.size());
    graph_.add_edge(a, b, ordinal, T_ab);
  }
  std::shared_ptr<const storage::WayAround> found(std::uint32_t query = 5) const {
    storage::ClosureProposalRecord proposal;
    proposal.query = {1, query};
    proposal.match = {2, 5};
    proposal.covariance = 1e-4 * Matrix6::Identity();
    return way_around(graph_, proposal);
  }

  const SE3 kMetre{Matrix3::Identity(), Vector3(0, 0, 1)};
  place::HandMadeGraph graph_;
};

TEST_F(HandMadeWay, BeginsAtTheLastFrameThatIsJoinedBeforeTheStop) {
  const auto around = found();
  ASSERT_TRUE(around);
  EXPECT_EQ(around->from, (FrameId{1, 1}));
  EXPECT_NEAR(around->T.t.z(), 5, 1e-6);
  join({2, 2}, {1, 3}, {});
  EXPECT_EQ(found()->from, (FrameId{1, 3}));
  join({2, 4}, {1, 5}, {});  // the query itself may be joined by another closure
  EXPECT_EQ(found()->from, (FrameId{1, 3}));
  join({2, 3}, {1, 4}, {});
  EXPECT_FALSE(found()) << "it is joined behind the stop";
}

TEST_F(HandMadeWay, IsSoughtAgainAtEvery16thFrameWhileNothingTellsOfTheStop) {
  for (std::uint32_t i = 6; i <= 18; ++i) {
    graph_.add_frame({1, i});
    graph_.add_edge({1, i - 1}, {1, i}, 0, kMetre);
  }
  join({2, 3}, {1, 4}, {});  // behind the stop
  EXPECT_FALSE(found(15));
  EXPECT_FALSE(found(17));
  const auto around = found(16);
  ASSERT_TRUE(around);
  EXPECT_EQ(around->from, (FrameId{1, 1}));
  join({3, 0}, {1, 16}, {});
  graph_.edit_hot({1, 16}).edges.back().around = around;
  graph_.edit_hot({1, 16}).edges.back().state = storage::EdgeState::kCandidate;
  EXPECT_TRUE(found(17)) << "one closure alone does not tell of a ride";
  graph_.edit_hot({1, 16}).edges.back().state = storage::EdgeState::kAccepted;
  EXPECT_FALSE(found(17)) << "that it leads over the stop is told now";
}

TEST_F(HandMadeWay, TellsNothingIfSomebodyStoodOrWasCarriedOnIt) {
  stand({2, 3}, 2);
  EXPECT_TRUE(found()) << "too shortly to be carried";
  stand({2, 4}, 2);
  EXPECT_FALSE(found());
  // Another way, longer by 20 m.
  join({2, 1}, {3, 0}, {Matrix3::Identity(), Vector3(10, 0, 0)});
  join({2, 5}, {3, 5}, {Matrix3::Identity(), Vector3(10, 0, 1)});
  const auto around = found();
  ASSERT_TRUE(around);
  EXPECT_NEAR(around->T.t.z(), 1 + 5 - 1, 1e-6);
  graph_.edit_hot({3, 2}).edges.front().carried_by = {{{3, 4}, 1}};
  EXPECT_FALSE(found());
  graph_.edit_hot({3, 2}).edges.front().carried_by.clear();
  EXPECT_TRUE(found());
  graph_.edit_hot({3, 2}).edges.front().source = MotionSource::kUnsensed;
  EXPECT_FALSE(found());
}

TEST_F(HandMadeWay, NeedsMotionOfItsOwnThatWasSensed) {
  graph_.edit_hot({1, 3}).edges.front().source = MotionSource::kUnsensed;
  EXPECT_FALSE(found());
}

TEST_F(HandMadeWay, IsNotNeededWhereAClosureWithItsOwnPastLeadsOverTheStop) {
  join({1, 0}, {1, 4}, {});
  EXPECT_FALSE(found());
}

}  // namespace
}  // namespace relmap::map
