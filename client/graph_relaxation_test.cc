#include "client/graph_relaxation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace relmap::client {
namespace {

Matrix6 diagonal(double metres, double radians) {
  Vector6 d;
  d << Vector3::Constant(metres * metres), Vector3::Constant(radians * radians);
  return d.asDiagonal();
}

// Two robots drive a circle of 31 m twice, the second 5 cm ahead, with noisy odometry; every fifth frame of each later
// lap is joined to the first.
struct Laps {
  static constexpr int kLap = 200, kFrames = 2 * kLap;
  static constexpr double kMetres = 0.01, kRadians = 0.002;

  std::vector<FrameId> frames;
  std::vector<SE3> truth;
  std::vector<RelaxationEdge> edges;
  std::mt19937 random{3};

  Laps() {
    for (const SessionNumber session : {1u, 2u})
      for (int k = 0; k < kFrames; ++k) {
        const double angle = 2 * M_PI * k / kLap + 0.01 * (session - 1);
        frames.push_back({session, static_cast<std::uint32_t>(k)});
        truth.push_back({so3_exp(Vector3(0, angle, 0)), 5 * Vector3(-std::cos(angle), 0, std::sin(angle))});
      }
    for (int begin : {0, kFrames})
      for (int k = 1; k < kFrames; ++k) connect(begin + k - 1, begin + k, RelaxationEdgeKind::kOdometry);
    for (int k = kLap; k < 2 * kFrames; k += 5) connect(k % kLap, k, RelaxationEdgeKind::kLoop);
  }
  void connect(int a, int b, RelaxationEdgeKind kind) {
    std::normal_distribution<double> normal;
    Vector6 noise;
    for (int i = 0; i < 6; ++i) noise[i] = (i < 3 ? kMetres : kRadians) * normal(random);
    edges.push_back(
        {frames[a], frames[b], truth[a].inverse() * truth[b] * SE3::exp(noise), diagonal(kMetres, kRadians), kind});
  }
  double error(const Relaxation& relaxed, std::size_t k) const {
    return (truth[0] * relaxed.poses[k].T_component_frame.t - truth[k].t).norm();
  }
  double mean_error(const Relaxation& relaxed) const {
    double sum = 0;
    for (std::size_t k = 0; k < truth.size(); ++k) sum += error(relaxed, k);
    return sum / static_cast<double>(truth.size());
  }
};

RelaxationOptions up_to(int max_direct) {
  RelaxationOptions options;
  options.max_direct = max_direct;
  return options;
}

// The same minimum is found as by the direct solver.
TEST(IterativeRelaxation, FindsTheMinimum) {
  const Laps laps;
  const auto direct = relax(laps.frames, laps.edges, up_to(10'000)).or_throw();
  ASSERT_TRUE(direct.converged);
  for (const int max_direct : {700, 100, 20}) {
    const auto relaxed = relax(laps.frames, laps.edges, up_to(max_direct)).or_throw();
    EXPECT_TRUE(relaxed.converged);
    EXPECT_EQ(relaxed.components, 1);
    EXPECT_EQ(relaxed.poses[0].T_component_frame, SE3());
    EXPECT_NEAR(relaxed.final_cost, direct.final_cost, 1e-4 * direct.final_cost) << max_direct;
    for (std::size_t k = 0; k < laps.frames.size(); ++k)
      EXPECT_LT((relaxed.poses[k].T_component_frame.t - direct.poses[k].T_component_frame.t).norm(), 0.005) << k;
  }
}

// What pictures are relaxed with: far less precise, and yet as near to the truth.
TEST(IterativeRelaxation, FewIterationsAreEnoughForAPicture) {
  const Laps laps;
  const double whole = laps.mean_error(relax(laps.frames, laps.edges, up_to(10'000)).or_throw());
  RelaxationOptions options = up_to(50);
  options.relative_tolerance = 1e-3;
  options.max_iterations = 4;
  const auto relaxed = relax(laps.frames, laps.edges, options).or_throw();
  EXPECT_TRUE(relaxed.converged);
  EXPECT_LT(relaxed.initial_cost, 10 * relaxed.final_cost) << "its cycles are closed from the start";
  EXPECT_LT(laps.mean_error(relaxed), 1.5 * whole + 0.005);
}

// A lift carries a robot 3 m up between two frames, which its odometry does not tell.
void expect_that_a_lift_is_where_it_was(std::uint32_t kBefore) {
  Laps laps;
  const SE3 lifted(Matrix3::Identity(), Vector3(0, -3, 0));
  for (std::size_t k = kBefore + 1; k < Laps::kFrames; ++k) laps.truth[k] = lifted * laps.truth[k];
  for (RelaxationEdge& edge : laps.edges) {
    if (edge.b == laps.frames[kBefore + 1] && edge.kind == RelaxationEdgeKind::kOdometry)
      edge.covariance = diagonal(100, 1);
    if (edge.kind == RelaxationEdgeKind::kLoop && edge.b.session == 1 && edge.b.index > kBefore) {
      const SE3& T_a = laps.truth[edge.a.index];
      edge.T_ab = T_a.inverse() * laps.truth[edge.b.index];
    }
  }
  const auto relaxed = relax(laps.frames, laps.edges, up_to(100)).or_throw();
  for (std::size_t k = kBefore - 1; k < std::min<std::size_t>(kBefore + 8, Laps::kFrames); ++k)
    EXPECT_LT(laps.error(relaxed, k), 0.1) << k;
}

TEST(IterativeRelaxation, AStepOfWhichLittleIsKnownTakesWhatIsWrongAroundIt) {
  expect_that_a_lift_is_where_it_was(Laps::kLap + 107);
}

TEST(IterativeRelaxation, ALiftShortlyBeforeTheEndOfADriveIsWhereItWas) {
  expect_that_a_lift_is_where_it_was(Laps::kFrames - 7);
}

TEST(IterativeRelaxation, FramesMayComeInAnyOrderAndInSeveralParts) {
  Laps laps;
  std::erase_if(laps.edges, [](const RelaxationEdge& edge) { return edge.a.session != edge.b.session; });
  const auto in_order = relax(laps.frames, laps.edges, up_to(100)).or_throw();
  EXPECT_EQ(in_order.components, 2);
  std::vector<FrameId> mixed = laps.frames;
  std::shuffle(mixed.begin(), mixed.end(), laps.random);
  const auto relaxed = relax(mixed, laps.edges, up_to(100)).or_throw();
  std::vector<SE3> T_first_frame(2);
  for (std::size_t k = 0; k < mixed.size(); ++k) {
    EXPECT_EQ(relaxed.poses[k].frame, mixed[k]);
    const std::size_t at = mixed[k].index + (mixed[k].session == 2 ? Laps::kFrames : 0);
    const bool first = std::none_of(mixed.begin(), mixed.begin() + static_cast<std::ptrdiff_t>(k),
                                    [&](FrameId id) { return id.session == mixed[k].session; });
    SE3& T = T_first_frame[mixed[k].session - 1];
    if (first) {
      EXPECT_EQ(relaxed.poses[k].T_component_frame, SE3());
      EXPECT_EQ(relaxed.poses[k].component, mixed[k].session == mixed[0].session ? 0 : 1);
      T = in_order.poses[at].T_component_frame;
    }
    EXPECT_LT(((T * relaxed.poses[k].T_component_frame).t - in_order.poses[at].T_component_frame.t).norm(), 1e-9);
  }
}

}  // namespace
}  // namespace relmap::client
