#include "server/rpc/trajectory.h"

#include <gtest/gtest.h>

#include "server/route/testing/drawn_map.h"

namespace relmap::rpc {
namespace {

class Trajectory : public testing::Test {
 protected:
  Trajectory() : map_("A--B----C") { map_.drive("ABC"); }
  storage::Session session() const { return *map_.session(1); }
  route::DrawnMap map_;
};

TEST_F(Trajectory, ChainsTheOdometryFromTheFirstFrame) {
  map_.editable(map_.id('B')).time_us = 1'700'000'000'000'042;
  const auto chained = map_.session(1);
  TrajectoryReader reader(map_, *chained);
  for (const char name : {'A', 'B', 'C'}) {
    const auto pose = reader.next().or_throw();
    ASSERT_TRUE(pose.has_value());
    EXPECT_EQ(pose->frame, map_.id(name));
    EXPECT_TRUE(pose->T_first_frame.t.isApprox(map_.position(name) - map_.position('A'), 1e-12));
    if (name == 'B') {
      EXPECT_EQ(trajectory_line(TrajectoryFormat::kTum, *pose), "1700000000.000042 3 0 0 0 0 0 1\n");
      EXPECT_EQ(trajectory_line(TrajectoryFormat::kKitti, *pose), "1 0 0 3 0 1 0 0 0 0 1 0\n");
    }
  }
  EXPECT_FALSE(reader.next().or_throw().has_value());
}

TEST_F(Trajectory, MarksStepsThatNothingMeasured) {
  storage::Edge& step = map_.editable(map_.id('B')).edges.front();
  step.kind = storage::EdgeKind::kPrior;
  step.source = MotionSource::kConstantVelocity;
  step.covariance = Vector6(0.25, 0.25, 0.25, 1, 1, 1).asDiagonal();
  map_.editable(map_.id('C')).edges.front().carried_by = {{{1, 2}, 1}};
  const auto second_line = [&](TrajectoryFormat format) {
    TrajectoryReader reader(map_, session());
    reader.next().or_throw();
    return trajectory_line(format, *reader.next().or_throw());
  };
  EXPECT_EQ(second_line(TrajectoryFormat::kTum),
            "# not measured: 1:0 to 1:1 (constant velocity, sigma 0.5 m)\n0.000000 3 0 0 0 0 0 1\n");
  EXPECT_EQ(second_line(TrajectoryFormat::kKitti), "1 0 0 3 0 1 0 0 0 0 1 0\n") << "it has no comments";

  TrajectoryReader reader(map_, session());
  EXPECT_EQ(reader.next().or_throw()->doubtful_step, nullptr);
  EXPECT_EQ(reader.next().or_throw()->doubtful_step->id, (EdgeId{map_.id('B'), 0}));
  EXPECT_NE(trajectory_line(TrajectoryFormat::kTum, *reader.next().or_throw())
                .find("# carried: 1:1 to 1:2, according to closure 1:2/1;"),
            std::string::npos);

  step.support = storage::kMinSupport;
  EXPECT_EQ(second_line(TrajectoryFormat::kTum), "0.000000 3 0 0 0 0 0 1\n") << "landmarks have measured it since";
}

TEST_F(Trajectory, HeadersNameSessionAndFrameWhereTheFormatCan) {
  EXPECT_NE(trajectory_header(TrajectoryFormat::kTum, session()).find("keyframe 1:0"), std::string::npos);
  EXPECT_EQ(trajectory_header(TrajectoryFormat::kKitti, session()), "");
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

TEST_F(Trajectory, ABrokenChainIsDataLoss) {
  map_.editable(map_.id('B')).edges.clear();
  TrajectoryReader reader(map_, session());
  EXPECT_TRUE(reader.next().ok());
  EXPECT_EQ(reader.next().reason(), Reason::DATA_LOSS);
}

}  // namespace
}  // namespace relmap::rpc
