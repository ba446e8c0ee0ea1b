#include "proto/linear/block_cholesky.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <random>

namespace relmap {
namespace {

TEST(BlockCholesky, AgreesWithADenseSolve) {
  std::mt19937 random(3);
  const int blocks = 12;
  const std::vector<std::pair<int, int>> pairs{{0, 1}, {1, 2}, {5, 2}, {3, 9}, {9, 3}, {11, 0}, {4, 10}, {7, 8}};
  BlockCholesky sparse(blocks, pairs);
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(6 * blocks, 6 * blocks);
  sparse.add(0, 0, Matrix6::Constant(1e9));  // cleared by set_zero()
  sparse.set_zero();
  for (int i = 0; i < blocks; ++i) {
    const Matrix6 m = Matrix6::Random();
    const Matrix6 block = m * m.transpose() + 30 * Matrix6::Identity();
    sparse.add(i, i, block);
    dense.block<6, 6>(6 * i, 6 * i) += block;
  }
  for (const auto& [i, j] : pairs) {
    const Matrix6 block = Matrix6::Random();
    sparse.add(i, j, block);
    dense.block<6, 6>(6 * i, 6 * j) += block;
    dense.block<6, 6>(6 * j, 6 * i) += block.transpose();
  }
  EXPECT_EQ(sparse.diagonal(), dense.diagonal());
  EXPECT_LT((sparse.dense() - dense).norm(), 1e-12 * dense.norm());
  const Eigen::VectorXd b = Eigen::VectorXd::Random(6 * blocks), extra = Eigen::VectorXd::Random(6 * blocks).cwiseAbs();
  for (const Eigen::VectorXd& damping : {Eigen::VectorXd(0 * extra), extra}) {
    ASSERT_TRUE(sparse.factorise(damping));
    const Eigen::VectorXd expected = (dense + Eigen::MatrixXd(damping.asDiagonal())).ldlt().solve(b);
    EXPECT_LT((sparse.solve(b) - expected).norm(), 1e-12 * expected.norm() + 1e-14);
  }
  EXPECT_FALSE(sparse.factorise(Eigen::VectorXd::Constant(6 * blocks, -1e3)));
}

}  // namespace
}  // namespace relmap
