#include "client/linear_start.h"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

namespace relmap::client {
namespace {

using Link = PoseGraph::Link;

// A robot drives five laps of 40 frames; from the second lap on every fourth frame has a loop to the lap before.
struct Drive {
  static constexpr int kLap = 40, kFrames = 5 * kLap;
  std::vector<SE3> truth;
  PoseGraph graph{kFrames, {}};
  std::mt19937 random{4};

  explicit Drive(double noise) {
    for (int i = 0; i < kFrames; ++i) {
      const double angle = 2 * std::numbers::pi * i / kLap;
      truth.push_back({so3_exp({0.02 * i, angle, 0}), {-9 * std::cos(angle), 0.01 * i, 9 * std::sin(angle)}});
    }
    const SE3 T_first_world = truth[0].inverse();
    for (SE3& pose : truth) pose = (T_first_world * pose).normalized();
    for (int i = 1; i < kFrames; ++i) join(i - 1, i, noise, false);
    for (int i = kLap; i < kFrames; i += 4) join(i - kLap, i, noise, true);
  }
  void join(int a, int b, double noise, bool robust) {
    std::normal_distribution<double> normal;
    Vector6 xi, sigmas;
    sigmas << Vector3::Constant(0.05), Vector3::Constant(0.01);
    for (int i = 0; i < 6; ++i) xi[i] = noise * sigmas[i] * normal(random);
    const auto at = [&](int i) -> const SE3& { return truth[static_cast<std::size_t>(i)]; };
    const Matrix6 covariance = sigmas.cwiseAbs2().asDiagonal();
    graph.links.push_back({a, b, at(a).inverse() * at(b) * SE3::exp(xi), covariance, robust});
  }
  std::vector<SE3> odometry() const {
    std::vector<SE3> poses(1);
    for (int i = 1; i < kFrames; ++i)
      poses.push_back((poses.back() * graph.links[static_cast<std::size_t>(i) - 1].T_ab).normalized());
    return poses;
  }
  double greatest_error(const std::vector<SE3>& poses) const {
    double greatest = 0;
    for (std::size_t i = 0; i < poses.size(); ++i) greatest = std::max(greatest, (poses[i].t - truth[i].t).norm());
    return greatest;
  }
};

TEST(LinearStart, OfAConsistentGraphItIsTheAnswerWhereverItStarts) {
  const Drive drive(0);
  std::vector<SE3> bent = drive.odometry();
  for (std::size_t i = 1; i < bent.size(); ++i) bent[i].R = bent[i].R * so3_exp({0.1, 0.2 * std::sin(0.1 * i), 0});
  const std::vector<SE3> start = start_linearly(drive.graph, bent, 4);
  EXPECT_EQ(start[0], SE3());
  EXPECT_LT(drive.greatest_error(start), 1e-3);
}

TEST(LinearStart, ClosesCyclesThatTheOdometryDoesNot) {
  const Drive drive(1);
  const double before = drive.greatest_error(drive.odometry());
  EXPECT_LT(drive.greatest_error(start_linearly(drive.graph, drive.odometry(), 4)), before / 3);
}

TEST(LinearStart, AWrongClosureBendsItLittle) {
  Drive drive(1);
  const double right = drive.greatest_error(start_linearly(drive.graph, drive.odometry(), 4));
  Link wrong = drive.graph.links.back();
  wrong.a = 10;
  wrong.T_ab.t = {5, 0, 5};
  drive.graph.links.push_back(wrong);
  const double bent = drive.greatest_error(start_linearly(drive.graph, drive.odometry(), 4)) - right;
  EXPECT_LT(bent, 0.5 * (drive.greatest_error(start_linearly(drive.graph, drive.odometry(), 0)) - right));
}

}  // namespace
}  // namespace relmap::client
