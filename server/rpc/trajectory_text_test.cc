#include "server/rpc/trajectory_text.h"

#include <gtest/gtest.h>

#include "server/route/testing/drawn_map.h"

namespace relmap::rpc {
namespace {

class TrajectoryText : public testing::Test {
 protected:
  TrajectoryText() : map_("A--B----C") { map_.drive("ABC"); }
  storage::Session session() const { return *map_.session(1); }
  // The line of the n-th pose, from 1 on.
  std::string line(int n, TrajectoryFormat format) const {
    route::TrajectoryReader reader(map_, session());
    for (int i = 1; i < n; ++i) reader.next().or_throw();
    return trajectory_line(format, *reader.next().or_throw());
  }
  route::DrawnMap map_;
};

TEST_F(TrajectoryText, ALineHoldsTimeAndPose) {
  map_.editable(map_.id('B')).time_us = 1'700'000'000'000'042;
  EXPECT_EQ(line(2, TrajectoryFormat::kTum), "1700000000.000042 3 0 0 0 0 0 1\n");
  EXPECT_EQ(line(2, TrajectoryFormat::kKitti), "1 0 0 3 0 1 0 0 0 0 1 0\n");
}

TEST_F(TrajectoryText, MarksDoubtfulStepsWhereTheFormatHasComments) {
  storage::Edge& step = map_.editable(map_.id('B')).edges.front();
  step.kind = storage::EdgeKind::kPrior;
  step.source = MotionSource::kConstantVelocity;
  step.covariance = Vector6(0.25, 0.25, 0.25, 1, 1, 1).asDiagonal();
  map_.editable(map_.id('C')).edges.front().carried_by = {{{1, 2}, 1}};
  EXPECT_EQ(line(2, TrajectoryFormat::kTum),
            "# not measured: 1:0 to 1:1 (constant velocity, sigma 0.5 m)\n0.000000 3 0 0 0 0 0 1\n");
  EXPECT_EQ(line(2, TrajectoryFormat::kKitti), "1 0 0 3 0 1 0 0 0 0 1 0\n") << "it has no comments";
  EXPECT_NE(line(3, TrajectoryFormat::kTum).find("# carried: 1:1 to 1:2, according to closure 1:2/1;"),
            std::string::npos);

  step.support = storage::kMinSupport;
  EXPECT_EQ(line(2, TrajectoryFormat::kTum), "0.000000 3 0 0 0 0 0 1\n") << "landmarks have measured it since";
}

TEST_F(TrajectoryText, HeadersNameSessionAndFrameWhereTheFormatCan) {
  EXPECT_NE(trajectory_header(TrajectoryFormat::kTum, session()).find("keyframe 1:0"), std::string::npos);
  EXPECT_EQ(trajectory_header(TrajectoryFormat::kKitti, session()), "");
}

}  // namespace
}  // namespace relmap::rpc
