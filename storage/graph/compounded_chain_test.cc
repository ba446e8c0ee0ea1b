#include "storage/graph/compounded_chain.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "storage/graph/precision.h"

namespace relmap::storage {
namespace {

// Odometry edges of a winding drive, each correlated with the one before.
std::vector<Edge> drive(std::uint32_t count, double correlation) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  std::vector<Edge> edges;
  for (std::uint32_t i = 1; i <= count; ++i) {
    Edge edge;
    edge.id = {{1, i}, 0};
    edge.a = {1, i - 1};
    edge.b = {1, i};
    Vector6 xi;
    for (int k = 0; k < 6; ++k) xi[k] = 0.3 * normal(random);
    edge.T_ab = SE3::exp(xi);
    Matrix6 root;
    for (int k = 0; k < 36; ++k) root.data()[k] = 0.01 * normal(random);
    edge.covariance = root * root.transpose() + 1e-5 * Matrix6::Identity();
    if (i > 1)
      for (std::size_t k = 0; k < 36; ++k)
        edge.correlation_with_previous[k] =
            static_cast<std::int8_t>(correlation * 127 * (k % 7 == 0 ? 1 : 0.1 * normal(random)));
    edges.push_back(edge);
  }
  return edges;
}

// The joint covariance of all edges' errors, propagated to the end of the chain in one step.
Matrix6 at_once(const std::vector<Edge>& edges, bool forward, bool with_common) {
  std::vector<Matrix6> carry;  // Jacobian by the edge's own xi
  const std::size_t n = edges.size();
  for (std::size_t i = 0; i < n; ++i) {
    SE3 rest;  // from behind edge i to the end
    if (forward)
      for (std::size_t k = i + 1; k < n; ++k) rest = rest * edges[k].T_ab;
    else
      for (std::size_t k = i; k-- > 0;) rest = rest * edges[k].T_ab.inverse();
    const Matrix6 J = forward ? Matrix6(Matrix6::Identity()) : Matrix6(-edges[i].T_ab.adjoint());
    carry.push_back(rest.inverse().adjoint() * J);
  }
  Matrix6 sum = Matrix6::Zero();
  for (std::size_t i = 0; i < n; ++i) {
    sum += carry[i] * edges[i].covariance * carry[i].transpose();
    if (i == 0 || !with_common) continue;
    const Matrix6 common =
        from_correlation(edges[i].correlation_with_previous, edges[i].covariance, edges[i - 1].covariance);
    const Matrix6 both = carry[i] * common * carry[i - 1].transpose();
    sum += both + both.transpose();
  }
  return sum;
}

CompoundedChain walk(const std::vector<Edge>& edges, bool forward) {
  CompoundedChain chain;
  if (forward)
    for (const Edge& edge : edges) chain.append(edge, true);
  else
    for (std::size_t i = edges.size(); i-- > 0;) chain.append(edges[i], false);
  return chain;
}

TEST(CompoundedChain, IncludesTheCorrelationOfNeighboursInBothDirections) {
  const std::vector<Edge> edges = drive(7, -0.3);
  SE3 T;
  for (const Edge& edge : edges) T = T * edge.T_ab;
  for (const bool forward : {true, false}) {
    const CompoundedChain chain = walk(edges, forward);
    const Matrix6 expected = at_once(edges, forward, true);
    EXPECT_LT((chain.covariance() - expected).norm(), 1e-9 * expected.norm()) << forward;
    EXPECT_LT(chain.covariance().trace(), at_once(edges, forward, false).trace());
    EXPECT_TRUE(chain.is_correlated());
    EXPECT_EQ(chain.edges(), edges.size());
    EXPECT_LT((chain.T().t - (forward ? T : T.inverse()).t).norm(), 1e-12);
  }
}

TEST(CompoundedChain, TakesEdgesAsIndependentWhereTheirCorrelationsAreImpossible) {
  const std::vector<Edge> edges = drive(7, -1);
  const CompoundedChain chain = walk(edges, true);
  const Matrix6 expected = at_once(edges, true, false);
  EXPECT_LT((chain.covariance() - expected).norm(), 1e-9 * expected.norm());
  EXPECT_FALSE(chain.is_correlated());
}

TEST(CompoundedChain, IsCertainWithoutEdges) {
  const CompoundedChain chain;
  EXPECT_EQ(chain.covariance(), Matrix6::Zero());
  EXPECT_TRUE(chain.is_correlated());
}

}  // namespace
}  // namespace relmap::storage
