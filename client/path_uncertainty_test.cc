#include "client/path_uncertainty.h"

#include <gtest/gtest.h>

#include <cmath>

namespace relmap::client {
namespace {

RelaxationEdge edge(std::uint32_t a, std::uint32_t b, const Vector3& t, double sigma_m, double sigma_rad) {
  RelaxationEdge edge;
  edge.a = {1, a};
  edge.b = {1, b};
  edge.T_ab.t = t;
  edge.covariance.setZero();
  edge.covariance.diagonal().head<3>().setConstant(sigma_m * sigma_m / 3);
  edge.covariance.diagonal().tail<3>().setConstant(sigma_rad * sigma_rad);
  return edge;
}
const std::vector<FrameId> kFrames{{1, 0}, {1, 1}, {1, 2}, {1, 3}, {1, 4}};
const Vector3 kAhead(0, 0, 1);

TEST(PositionSigmas, GrowAlongTheWay) {
  const auto sigmas = position_sigmas(
      kFrames, {edge(0, 1, kAhead, 0.3, 0), edge(1, 2, kAhead, 0.4, 0), edge(3, 2, -kAhead, 1.2, 0)}, {1, 0});
  EXPECT_NEAR(sigmas[0], 0, 1e-12);
  EXPECT_NEAR(sigmas[1], 0.3, 1e-9);
  EXPECT_NEAR(sigmas[2], 0.5, 1e-9);
  EXPECT_NEAR(sigmas[3], 1.3, 1e-9) << "an edge is passed in both directions";
  EXPECT_TRUE(std::isinf(sigmas[4])) << "nothing leads there";
}

TEST(PositionSigmas, ClosuresMakeThemSmaller) {
  std::vector<RelaxationEdge> edges{edge(0, 1, kAhead, 0.3, 0), edge(1, 2, kAhead, 0.4, 0)};
  edges.push_back(edge(0, 2, 2 * kAhead, 0.01, 0));
  EXPECT_NEAR(position_sigmas(kFrames, edges, {1, 0})[2], 0.01, 1e-9);
}

TEST(PositionSigmas, RotationsCountWithTheDistanceBehindThem) {
  const auto sigmas = position_sigmas(kFrames, {edge(0, 1, kAhead, 0, 0.01), edge(1, 2, 100 * kAhead, 0, 0)}, {1, 0});
  EXPECT_NEAR(sigmas[1], 0, 1e-9);
  EXPECT_NEAR(sigmas[2], 100 * 0.01 * std::sqrt(2), 1e-6) << "about two axes across the way";
}

TEST(PositionSigmas, OfARootThatIsNotThereNothingIsKnown) {
  for (const double sigma : position_sigmas(kFrames, {edge(0, 1, kAhead, 0.3, 0)}, {9, 9}))
    EXPECT_TRUE(std::isinf(sigma));
}

}  // namespace
}  // namespace relmap::client
