#include "server/route/trajectory.h"

#include <gtest/gtest.h>

#include <utility>
#include <vector>

#include "proto/geometry/camera.h"
#include "server/route/testing/drawn_map.h"

namespace relmap::route {
namespace {

class Trajectory : public testing::Test {
 protected:
  Trajectory() : map_("A--B----C") { map_.drive("ABC"); }
  storage::Session session() const { return *map_.session(1); }
  DrawnMap map_;
};

TEST_F(Trajectory, ChainsTheOdometryFromTheFirstFrame) {
  const auto chained = map_.session(1);
  TrajectoryReader reader(map_, *chained);
  for (const char name : {'A', 'B', 'C'}) {
    const auto pose = reader.next().or_throw();
    ASSERT_TRUE(pose.has_value());
    EXPECT_EQ(pose->frame, map_.id(name));
    EXPECT_TRUE(pose->T_first_frame.t.isApprox(map_.position(name) - map_.position('A'), 1e-12));
  }
  EXPECT_FALSE(reader.next().or_throw().has_value());
}

TEST_F(Trajectory, NamesStepsThatNothingMeasuredOrThatTheRobotWasCarried) {
  storage::Edge& step = map_.editable(map_.id('B')).edges.front();
  step.kind = storage::EdgeKind::kPrior;
  step.source = MotionSource::kConstantVelocity;
  map_.editable(map_.id('C')).edges.front().carried_by = {{{1, 2}, 1}};
  TrajectoryReader reader(map_, session());
  EXPECT_EQ(reader.next().or_throw()->doubtful_step, nullptr);
  EXPECT_EQ(reader.next().or_throw()->doubtful_step->id, (EdgeId{map_.id('B'), 0}));
  EXPECT_EQ(reader.next().or_throw()->doubtful_step->id, (EdgeId{map_.id('C'), 0}));

  step.support = storage::kMinSupport;
  TrajectoryReader again(map_, session());
  again.next().or_throw();
  EXPECT_EQ(again.next().or_throw()->doubtful_step, nullptr) << "landmarks have measured it since";
}

TEST_F(Trajectory, AFrameThatNoEdgeLeadsToIsDataLoss) {
  map_.editable(map_.id('B')).incoming.clear();
  TrajectoryReader reader(map_, session());
  EXPECT_TRUE(reader.next().ok());
  EXPECT_EQ(reader.next().reason(), Reason::DATA_LOSS);
}

// Stepping through the billions of missing sequences one by one would take hours.
TEST_F(Trajectory, GapsAreSkippedInOneStep) {
  constexpr FrameId kLate{1, 4'000'000'000};
  map_.leave_a_gap('B', 'C', kLate);
  storage::Session session = this->session();
  session.last = kLate.index;
  TrajectoryReader reader(map_, session);
  for (const FrameId expected : {map_.id('A'), map_.id('B'), kLate}) {
    const auto pose = reader.next().or_throw();
    ASSERT_TRUE(pose.has_value());
    EXPECT_EQ(pose->frame, expected);
  }
  EXPECT_FALSE(reader.next().or_throw().has_value());
}

TEST_F(Trajectory, StereoSessionsThatStayHaveOne) {
  const auto numbers = [&](std::vector<SessionNumber> chosen) {
    std::vector<SessionNumber> found;
    for (const storage::Session& session : sessions_with_trajectory(map_, std::move(chosen)).or_throw())
      found.push_back(session.number);
    return found;
  };
  for (int i = 0; i < 3; ++i) map_.drive("ABC");
  for (const SessionNumber number : {1u, 3u, 4u}) map_.edit_session(number).header.camera = kNoCamera;
  EXPECT_EQ(numbers({}), (std::vector<SessionNumber>{1, 3, 4}));
  EXPECT_EQ(numbers({4, 1, 4}), (std::vector<SessionNumber>{1, 4}));
  EXPECT_EQ(sessions_with_trajectory(map_, {4, 2}).status().to_string(),
            "NOT_STEREO: session 2 is a mono session and has no trajectory");
  EXPECT_EQ(sessions_with_trajectory(map_, {2, 5, 0}).status().to_string(), "NO_SUCH_SESSION: no session 0");

  for (const SessionNumber number : {2u, 3u, 4u}) map_.edit_session(number).state = storage::SessionState::kDeleting;
  for (const SessionNumber number : {2u, 3u}) map_.edit_session(number).frames = 0;
  EXPECT_EQ(numbers({}), (std::vector<SessionNumber>{1, 4})) << "of one that is being deleted there is some left";
  EXPECT_EQ(sessions_with_trajectory(map_, {2}).status().to_string(), "SESSION_DELETED: session 2 was deleted");
}

TEST_F(Trajectory, ShowsLandmarksInForceWhoseDepthIsMeasured) {
  const EdgeId closure = map_.close("AC");
  map_.editable(map_.id('A')).landmarks.resize(1);
  auto& landmarks = map_.editable(map_.id('C')).landmarks;
  landmarks.resize(4);
  landmarks[0].depth_prior = true;
  landmarks[2].claims.push_back({{map_.id('A'), 0}, closure});
  landmarks[3].claims.push_back({{}, closure});  // not needed
  const auto shown = [&] { return shown_landmarks(map_, {map_.id('C'), map_.hot(map_.id('C')), {}}); };
  EXPECT_EQ(shown(), (std::vector<std::uint32_t>{1}));
  map_.set_state(closure, storage::EdgeState::kRemoved);
  EXPECT_EQ(shown(), (std::vector<std::uint32_t>{1, 2, 3}));
}

TEST_F(Trajectory, ABrokenChainIsDataLoss) {
  map_.editable(map_.id('B')).edges.clear();
  TrajectoryReader reader(map_, session());
  EXPECT_TRUE(reader.next().ok());
  EXPECT_EQ(reader.next().reason(), Reason::DATA_LOSS);
}

}  // namespace
}  // namespace relmap::route
