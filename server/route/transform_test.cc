#include "server/route/transform.h"

#include <gtest/gtest.h>

#include "server/route/testing/drawn_map.h"
#include "storage/graph/precision.h"

namespace relmap::route {
namespace {

TEST(Transform, FollowsThePathWithTheFewestEdges) {
  DrawnMap map(R"(
    A---B---C
    .       |
    E-------D
  )");
  map.drive("ABCDE");
  EXPECT_EQ(transform_between(map, map.id('A'), map.id('E'))->edges, 4u);
  map.close("AE");
  const auto found = transform_between(map, map.id('B'), map.id('E'));
  ASSERT_TRUE(found.ok());
  EXPECT_EQ(found->edges, 2u);
  EXPECT_NEAR(found->distance_m, 6, 1e-12);
  EXPECT_TRUE(found->T_ab.t.isApprox(map.position('E') - map.position('B'), 1e-12));
}

TEST(Transform, ToItselfIsCertain) {
  DrawnMap map("A-B");
  map.drive("AB");
  const auto found = transform_between(map, map.id('A'), map.id('A'));
  ASSERT_TRUE(found.ok());
  EXPECT_EQ(found->edges, 0u);
  EXPECT_EQ(found->covariance, Matrix6::Zero());
}

// Compares with the definition: T_ab Exp(xi) is propagated numerically through products and inverses.
TEST(Transform, CovarianceIsCompoundedWithTurnsAndInBothDirections) {
  DrawnMap map("A--B--C--D");
  map.drive("ABCD");
  Vector6 twist;
  twist << 1, -0.2, 0.5, 0.3, 0.8, -0.4;
  Vector6 sigma;
  sigma << 0.01, 0.02, 0.03, 0.004, 0.005, 0.006;
  for (const char name : {'B', 'C', 'D'}) {
    storage::Edge& edge = map.editable(map.id(name)).edges[0];
    edge.T_ab = SE3::exp(twist);
    edge.covariance = sigma.cwiseAbs2().asDiagonal();
    if (name != 'B')
      for (std::size_t k = 0; k < 36; ++k)
        edge.correlation_with_previous[k] = static_cast<std::int8_t>(k % 7 == 0 ? -40 : static_cast<int>(k % 5) - 2);
    twist = 1.3 * twist.reverse().eval();
    sigma = 1.1 * sigma;
  }
  const auto product = [&](FrameId from, FrameId to, const std::vector<Vector6>& xi) {
    SE3 T_ad;
    for (const char name : {'B', 'C', 'D'})
      T_ad = T_ad * map.editable(map.id(name)).edges[0].T_ab * SE3::exp(xi[static_cast<std::size_t>(name - 'B')]);
    return from < to ? T_ad : T_ad.inverse();
  };
  for (const auto& [from, to] : {std::pair{map.id('A'), map.id('D')}, std::pair{map.id('D'), map.id('A')}}) {
    const std::vector<Vector6> zero(3, Vector6::Zero());
    const SE3 T = product(from, to, zero);
    Matrix6 expected = Matrix6::Zero();
    std::vector<Matrix6> jacobians;
    for (std::size_t e = 0; e < 3; ++e) {
      Matrix6& J = jacobians.emplace_back();
      for (int i = 0; i < 6; ++i) {
        std::vector<Vector6> xi = zero;
        xi[e][i] = 1e-6;
        J.col(i) = (T.inverse() * product(from, to, xi)).log() / 1e-6;
      }
      const storage::Edge& edge = map.editable(map.id(static_cast<char>('B' + e))).edges[0];
      expected += J * edge.covariance * J.transpose();
      if (e == 0) continue;
      const storage::Edge& previous = map.editable(map.id(static_cast<char>('A' + e))).edges[0];
      const Matrix6 common =
          J * storage::from_correlation(edge.correlation_with_previous, edge.covariance, previous.covariance) *
          jacobians[e - 1].transpose();
      expected += common + common.transpose();
    }
    const auto found = transform_between(map, from, to);
    ASSERT_TRUE(found.ok());
    EXPECT_TRUE(found->T_ab.t.isApprox(T.t, 1e-12));
    EXPECT_TRUE(found->covariance.isApprox(expected, 1e-5)) << found->covariance << "\n\n" << expected;
  }
}

TEST(Transform, SaysWhetherItsCovarianceIsCompounded) {
  DrawnMap map("A--B--C--D");
  map.drive("ABCD");
  const auto compounded = [&](char a, char b) { return transform_between(map, map.id(a), map.id(b))->compounded; };
  EXPECT_FALSE(compounded('A', 'B'));
  EXPECT_TRUE(compounded('A', 'C')) << "what the two have in common is not known";
  for (std::size_t k = 0; k < 36; k += 7) map.editable(map.id('C')).edges[0].correlation_with_previous[k] = -40;
  EXPECT_FALSE(compounded('A', 'C'));
  EXPECT_FALSE(compounded('C', 'A'));
  EXPECT_TRUE(compounded('A', 'D'));
}

TEST(Transform, TakesEdgesAsIndependentWhereTheirCorrelationIsImpossible) {
  DrawnMap map("A--B--C--D");
  map.drive("ABCD");
  for (const char name : {'B', 'C', 'D'}) map.editable(map.id(name)).edges[0].T_ab = SE3();
  const Matrix6 independent = transform_between(map, map.id('A'), map.id('D'))->covariance;
  for (const char name : {'C', 'D'})
    for (std::size_t k = 0; k < 36; k += 7) map.editable(map.id(name)).edges[0].correlation_with_previous[k] = -127;
  EXPECT_EQ(transform_between(map, map.id('A'), map.id('D'))->covariance, independent);
}

TEST(Transform, TellsOutOfReachFromNotConnected) {
  DrawnMap map("A-B-C-D-E   F-G");
  map.drive("ABCDE");
  map.drive("FG");
  EXPECT_EQ(transform_between(map, map.id('A'), map.id('G')).reason(), Reason::NOT_CONNECTED);
  EXPECT_EQ(transform_between(map, map.id('A'), map.id('E'), {.max_frames = 4, .proceed = {}}).reason(),
            Reason::OUT_OF_REACH);
  EXPECT_TRUE(transform_between(map, map.id('A'), map.id('E'), {.max_frames = 5, .proceed = {}}).ok());
  EXPECT_EQ(transform_between(map, map.id('A'), {9, 9}).reason(), Reason::NO_SUCH_FRAME);
  EXPECT_EQ(transform_between(map, {9, 9}, map.id('A')).reason(), Reason::NO_SUCH_FRAME);
}

}  // namespace
}  // namespace relmap::route
