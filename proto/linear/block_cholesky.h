// A sparse symmetric positive definite system of 6x6 blocks, solved by CHOLMOD.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <utility>
#include <vector>

#include "proto/geometry/geometry.h"

namespace relmap {

// The pattern is fixed when it is made and analysed once; values may be set and factorised again and again.
// Not thread-safe; different objects may be used by different threads.
class BlockCholesky {
 public:
  // `pairs`: the blocks (i, j), i != j, that may be non-zero, in either order, repeated or not.
  BlockCholesky(int blocks, const std::vector<std::pair<int, int>>& pairs);
  ~BlockCholesky();
  BlockCholesky(const BlockCholesky&) = delete;
  BlockCholesky& operator=(const BlockCholesky&) = delete;

  void set_zero();
  // Adds `block` at (i, j) and, for i != j, its transpose at (j, i). Of a block on the diagonal the upper triangle
  // counts.
  void add(int i, int j, const Matrix6& block);
  Eigen::VectorXd diagonal() const;
  // Of the matrix plus the diagonal matrix `extra`. False: not positive definite, or no memory.
  bool factorise(const Eigen::VectorXd& extra);
  // After factorise() has returned true.
  Eigen::VectorXd solve(const Eigen::VectorXd& right_side) const;

  // The matrix as it was added up, whole: for tests.
  Eigen::MatrixXd dense() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace relmap
