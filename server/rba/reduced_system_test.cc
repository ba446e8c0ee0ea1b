#include "server/rba/reduced_system.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <random>

namespace relmap::rba {
namespace {

// A chain of blocks with one loop; its lower triangle.
Eigen::MatrixXd banded(int blocks) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  Eigen::MatrixXd A = Eigen::MatrixXd::Identity(6 * blocks, 6 * blocks);
  const auto couple = [&](int p, int q) {
    Eigen::MatrixXd J(8, 12);
    for (Eigen::Index k = 0; k < J.size(); ++k) J.data()[k] = normal(random);
    const Eigen::MatrixXd M = J.transpose() * J;
    A.block<6, 6>(6 * p, 6 * p) += M.topLeftCorner<6, 6>();
    A.block<6, 6>(6 * q, 6 * q) += M.bottomRightCorner<6, 6>();
    A.block<6, 6>(6 * q, 6 * p) += M.bottomLeftCorner<6, 6>();
  };
  for (int p = 0; p + 1 < blocks; ++p) couple(p, p + 1);
  couple(0, blocks - 1);
  return A.triangularView<Eigen::Lower>();
}

TEST(ReducedSystem, SolvesSmallAndLargeSystemsAlike) {
  for (const int blocks : {8, 120}) {
    const Eigen::MatrixXd A = banded(blocks);
    const Eigen::MatrixXd whole = A.selfadjointView<Eigen::Lower>();
    const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(A.rows(), -1, 1);
    ReducedSystem system;
    ASSERT_TRUE(system.factor(A, 0));
    EXPECT_LT((whole * system.solve(b) - b).norm(), 1e-9 * b.norm());
    const Eigen::MatrixXd inverse = whole.inverse();
    for (const int c : {0, blocks / 2, blocks - 1})
      EXPECT_LT((system.inverse_columns(c) - inverse.middleCols<6>(6 * c)).norm(), 1e-9) << blocks << " " << c;
    Eigen::MatrixXd damped = whole;
    damped.diagonal() *= 1.5;
    ASSERT_TRUE(system.factor(A, 0.5));
    EXPECT_LT((damped * system.solve(b) - b).norm(), 1e-9 * b.norm());
  }
}

TEST(ReducedSystem, RefusesWhatIsNotPositiveDefinite) {
  for (const int blocks : {8, 120}) {
    Eigen::MatrixXd A = banded(blocks);
    A(20, 20) = -1;
    EXPECT_FALSE(ReducedSystem().factor(A, 0)) << blocks;
  }
}

}  // namespace
}  // namespace relmap::rba
