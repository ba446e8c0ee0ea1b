#include "tools/g2o/pose_graph.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <random>
#include <sstream>

#include "proto/geometry/covariance.h"

namespace relmap::g2o {
namespace {

constexpr char kPlane[] = R"(VERTEX_SE2 10 0 0 0
VERTEX_SE2 20 2 1 0.5
VERTEX_SE2 30 2 3 1.5
# a remark
EDGE_SE2 10 20 2 1 0.5 100 0 0 25 0 400
EDGE_SE2 30 20 -1 0.5 -1 100 0 0 25 0 400
EDGE_SE2 10 30 2 3 1.5 4 1 0 4 0 1
EDGE_SE2 20 20 0 0 0 1 0 0 1 0 1
FIX 10
)";

TEST(PoseGraph, OfThePlaneIsConvertedToTheCamerasFrame) {
  const PoseGraph graph = parse_pose_graph(kPlane, "test").or_throw();
  EXPECT_TRUE(graph.planar);
  EXPECT_EQ(graph.ids, (std::vector<std::uint32_t>{10, 20, 30}));
  // 2 m ahead and 1 m to the left, then turned to the left.
  EXPECT_LT((graph.poses[1].t - Vector3(-1, 0, 2)).norm(), 1e-12);
  EXPECT_LT((graph.poses[1].R * Vector3(0, 0, 1) - Vector3(-std::sin(0.5), 0, std::cos(0.5))).norm(), 1e-12);
  ASSERT_EQ(graph.odometry.size(), 2u);
  const PoseGraph::Edge& first = graph.odometry[0];
  EXPECT_EQ(first.b, 1u);
  EXPECT_LT((first.T_ab.t - Vector3(-1, 0, 2)).norm(), 1e-12);
  EXPECT_NEAR(first.covariance(2, 2), 0.01, 1e-12) << "ahead";
  EXPECT_NEAR(first.covariance(0, 0), 0.04, 1e-12) << "to the side";
  EXPECT_NEAR(first.covariance(4, 4), 0.0025, 1e-12) << "about the upright";
  EXPECT_NEAR(first.covariance(1, 1), 1e-8, 1e-12) << "the plane has no height";
  // Written the other way round.
  EXPECT_LT((graph.odometry[1].T_ab.inverse().t - Vector3(-0.5, 0, -1)).norm(), 1e-12);
  ASSERT_EQ(graph.loops.size(), 1u);
  EXPECT_EQ(graph.loops[0].a, 2u) << "the later one recognised the earlier";
  EXPECT_EQ(graph.loops[0].b, 0u);
  EXPECT_LT((graph.loops[0].T_ab.inverse().t - Vector3(-3, 0, 2)).norm(), 1e-12);
  EXPECT_EQ(graph.self_edges, std::vector<std::size_t>{8});
  EXPECT_EQ(graph.left_out, (std::map<std::string, std::size_t>{{"FIX", 1}}));
  EXPECT_EQ(graph.step_to(1), &graph.odometry[0]);
  EXPECT_EQ(graph.step_to(0), nullptr);
}

TEST(PoseGraph, OfSeveralLoopsBetweenTwoFramesTheFirstCounts) {
  std::string text;
  for (int i = 1; i < 4; ++i)
    text += "EDGE_SE2 " + std::to_string(i - 1) + " " + std::to_string(i) + " 1 0 0 1 0 0 1 0 1\n";
  text +=
      "EDGE_SE2 3 0 -3 0 0 1 0 0 1 0 1\n"
      "EDGE_SE2 0 3 3.5 0 0 1 0 0 1 0 1\n"  // the other way round
      "EDGE_SE2 3 1 -2 0 0 1 0 0 1 0 1\n"
      "EDGE_SE2 3 0 -3 0 0 1 0 0 1 0 1\n";
  const auto graph = parse_pose_graph(text, "text").or_throw();
  ASSERT_EQ(graph.loops.size(), 2u);
  EXPECT_NEAR(graph.loops[0].T_ab.t.norm(), 3, 1e-12);
  EXPECT_EQ(graph.parallel_loops, (std::vector<std::size_t>{5, 7}));
}

// Poses in space written with the error that g2o minimises: the covariance found in samples is the one read.
TEST(PoseGraph, TheInformationOfAQuaternionIsOfHalfAngles) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> gauss;
  Vector6 sigma;
  sigma << 0.1, 0.2, 0.3, 0.01, 0.02, 0.03;
  Matrix6 sampled = Matrix6::Zero();  // of (t, vector part of q)
  constexpr int kSamples = 200000;
  for (int i = 0; i < kSamples; ++i) {
    const Vector6 xi = sigma.cwiseProduct(Vector6::NullaryExpr([&] { return gauss(random); }));
    Vector6 error;
    error << xi.head<3>(), Eigen::Quaterniond(so3_exp(xi.tail<3>())).vec();
    sampled += error * error.transpose() / kSamples;
  }
  const UpperTriangle information = upper_triangle(sampled.inverse());
  std::ostringstream text;
  text << "VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\nVERTEX_SE3:QUAT 1 1 2 3 0 0 0 1\nEDGE_SE3:QUAT 0 1 1 2 3 0 0 0 1";
  for (const double value : information) text << ' ' << value;
  const PoseGraph graph = parse_pose_graph(text.str(), "test").or_throw();
  EXPECT_FALSE(graph.planar);
  EXPECT_LT((graph.odometry.at(0).T_ab.t - Vector3(1, 2, 3)).norm(), 1e-12);
  EXPECT_LT((graph.odometry[0].covariance.diagonal().cwiseSqrt() - sigma).cwiseQuotient(sigma).cwiseAbs().maxCoeff(),
            0.02);
  const PoseGraph robot = parse_pose_graph(text.str(), "test", PoseAxes::kRobot).or_throw();
  EXPECT_LT((robot.odometry.at(0).T_ab.t - Vector3(-2, -3, 1)).norm(), 1e-12);
  EXPECT_NEAR(std::sqrt(robot.odometry[0].covariance(2, 2)), 0.1, 0.002) << "the robot's x is ahead";
}

TEST(PoseGraph, OfEdgesOnlyHasTheVerticesOfTheEdges) {
  const PoseGraph graph =
      parse_pose_graph("EDGE_SE2 5 6 1 0 0 1 0 0 1 0 1\nEDGE_SE2 6 7 1 0 0 1 0 0 1 0 1", "f").or_throw();
  EXPECT_EQ(graph.ids, (std::vector<std::uint32_t>{5, 6, 7}));
  EXPECT_LT((graph.poses[2].t - Vector3(0, 0, 2)).norm(), 1e-12);
  EXPECT_EQ(parse_pose_graph("EDGE_SE2 5 7 1 0 0 1 0 0 1 0 1\nEDGE_SE2 6 7 1 0 0 1 0 0 1 0 1", "f").status().message(),
            "f: no vertices, and no odometry to 6");
}

TEST(PoseGraph, WhatIsWrongIsNamedWithItsLine) {
  const auto why = [](const std::string& text) {
    const auto graph = parse_pose_graph(text, "f");
    EXPECT_EQ(graph.reason(), Reason::CORRUPT) << text;
    return graph.status().message();
  };
  EXPECT_EQ(why("VERTEX_SE2 0 0 0"), "f, line 1: x, y and theta are wanted");
  EXPECT_EQ(why("\nVERTEX_SE2 0 0 0 nan"), "f, line 2: x, y and theta are wanted");
  EXPECT_EQ(why("VERTEX_SE2 0 0 0 1e200"), "f, line 1: an angle of more than 10,000 radians");
  EXPECT_EQ(why("VERTEX_SE2 0 1e300 0 0"), "f, line 1: more than 10,000 km");
  EXPECT_EQ(why("VERTEX_SE2 -1 0 0 0"), "f, line 1: a vertex whose number is not 0..4294967295");
  EXPECT_EQ(why("VERTEX_SE2 0 0 0 0\nVERTEX_SE2 0 0 0 0"), "f, line 2: vertex 0 was there before");
  EXPECT_EQ(why("VERTEX_SE2 0 0 0 0\nEDGE_SE2 0 7 0 0 0 1 0 0 1 0 1"),
            "f, line 2: an edge to a vertex that is not there");
  EXPECT_EQ(why("VERTEX_SE2 0 0 0 0\nEDGE_SE2 0 0 0 0 0 1 0 0 -1 0 1"), "f, line 2: the information matrix is none");
  EXPECT_EQ(why("VERTEX_SE2 0 0 0 0\nVERTEX_SE3:QUAT 1 0 0 0 0 0 0 1"),
            "f, line 2: poses in the plane and poses in space");
  EXPECT_EQ(why("VERTEX_SE3:QUAT 1 0 0 0 0 0 0 0"), "f, line 1: the quaternion is no rotation");
  EXPECT_EQ(read_pose_graph("/no/such/file").reason(), Reason::NO_SUCH_FILE);
}

}  // namespace
}  // namespace relmap::g2o
