#include "client/contraction.h"

#include <gtest/gtest.h>

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

TEST(Contraction, FewFramesAreRelaxedAsTheyAre) {
  const Laps laps;
  const auto whole = relax(laps.frames, laps.edges).or_throw();
  const auto same = relax_contracted(laps.frames, laps.edges, laps.frames.size()).or_throw();
  EXPECT_EQ(same.kept, laps.frames.size());
  EXPECT_EQ(same.edges.size(), laps.edges.size());
  EXPECT_EQ(same.relaxation.final_cost, whole.final_cost);
  for (std::size_t k = 0; k < laps.frames.size(); ++k)
    EXPECT_EQ(same.relaxation.poses[k].T_component_frame, whole.poses[k].T_component_frame);
}

TEST(Contraction, AContractedMapIsNearlyAsGoodAsTheWhole) {
  const Laps laps;
  const double whole = laps.mean_error(relax(laps.frames, laps.edges).or_throw());
  for (const std::size_t max_frames : {400u, 160u, 80u}) {
    const auto contracted = relax_contracted(laps.frames, laps.edges, max_frames).or_throw();
    EXPECT_LE(contracted.kept, max_frames + 2);
    EXPECT_EQ(contracted.edges.size(), contracted.stands_for.size());
    EXPECT_EQ(contracted.relaxation.poses.size(), laps.frames.size());
    EXPECT_EQ(contracted.relaxation.components, 1);
    EXPECT_EQ(contracted.relaxation.poses[0].T_component_frame, SE3());
    EXPECT_LT(laps.mean_error(contracted.relaxation), 1.5 * whole + 0.005) << max_frames;
    // Between two kept frames no step is torn.
    for (std::size_t k = 1; k < laps.frames.size(); ++k) {
      if (laps.frames[k].session != laps.frames[k - 1].session) continue;
      const SE3 step = contracted.relaxation.poses[k - 1].T_component_frame.inverse() *
                       contracted.relaxation.poses[k].T_component_frame;
      EXPECT_LT((step.t - (laps.truth[k - 1].inverse() * laps.truth[k]).t).norm(), 6 * Laps::kMetres) << k;
    }
  }
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
  const auto contracted = relax_contracted(laps.frames, laps.edges, 100).or_throw();
  for (std::size_t k = kBefore - 1; k < std::min<std::size_t>(kBefore + 8, Laps::kFrames); ++k)
    EXPECT_LT(laps.error(contracted.relaxation, k), 0.1) << k;
  bool stands = false;
  for (std::size_t e = 0; e < contracted.edges.size(); ++e)
    stands = stands || laps.edges[contracted.stands_for[e]].b == laps.frames[kBefore + 1];
  EXPECT_TRUE(stands) << "the stretch is named by its least certain step";
}

TEST(Contraction, AStepOfWhichLittleIsKnownTakesWhatIsWrongAroundIt) {
  expect_that_a_lift_is_where_it_was(Laps::kLap + 107);
}

TEST(Contraction, ALiftShortlyBeforeTheEndOfADriveIsWhereItWas) {
  expect_that_a_lift_is_where_it_was(Laps::kFrames - 7);
}

TEST(Contraction, FramesMayComeInAnyOrderAndInSeveralParts) {
  Laps laps;
  std::erase_if(laps.edges, [](const RelaxationEdge& edge) { return edge.a.session != edge.b.session; });
  const auto in_order = relax_contracted(laps.frames, laps.edges, 100).or_throw();
  EXPECT_EQ(in_order.relaxation.components, 2);
  std::vector<FrameId> mixed = laps.frames;
  std::shuffle(mixed.begin(), mixed.end(), laps.random);
  const auto contracted = relax_contracted(mixed, laps.edges, 100).or_throw();
  for (std::size_t k = 0; k < mixed.size(); ++k) {
    EXPECT_EQ(contracted.relaxation.poses[k].frame, mixed[k]);
    const std::size_t at = mixed[k].index + (mixed[k].session == 2 ? Laps::kFrames : 0);
    EXPECT_EQ(contracted.relaxation.poses[k].T_component_frame, in_order.relaxation.poses[at].T_component_frame);
    EXPECT_EQ(contracted.relaxation.poses[k].component, in_order.relaxation.poses[at].component);
  }
}

TEST(Contraction, TellsWhatIsWrongWithAGraph) {
  Laps laps;
  const auto reason = [&] { return relax_contracted(laps.frames, laps.edges, 100).reason(); };
  RelaxationEdge& edge = laps.edges[7];
  const RelaxationEdge sound = edge;
  edge.a = {9, 9};
  EXPECT_EQ(reason(), Reason::INVALID_ARGUMENT);
  edge = sound;
  edge.T_ab.t.x() = std::nan("");
  EXPECT_EQ(reason(), Reason::NOT_FINITE);
  edge = sound;
  edge.covariance.setZero();
  EXPECT_EQ(reason(), Reason::BAD_COVARIANCE);
  edge = sound;
  laps.frames.push_back(laps.frames[0]);
  EXPECT_EQ(reason(), Reason::INVALID_ARGUMENT);
}

}  // namespace
}  // namespace relmap::client
