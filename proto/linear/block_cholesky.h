// Solves sparse symmetric positive definite systems of 6x6 blocks with CHOLMOD.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <utility>
#include <vector>

#include "proto/geometry/geometry.h"

namespace relmap {

// The sparsity pattern is fixed and analysed by the constructor; values may be set and factorised any number of times.
// Not thread-safe; different objects may be used by different threads.
class BlockCholesky {
 public:
  // `pairs`: the blocks (i, j), i != j, that may be non-zero; (i, j) and (j, i) are the same, and repeats are allowed.
  BlockCholesky(int blocks, const std::vector<std::pair<int, int>>& pairs);
  ~BlockCholesky();
  BlockCholesky(const BlockCholesky&) = delete;
  BlockCholesky& operator=(const BlockCholesky&) = delete;

  // Floating-point operations of a factorisation.
  double work() const;

  void set_zero();
  // Adds `block` at (i, j) and, for i != j, its transpose at (j, i). Only the upper triangle of a block on the diagonal
  // is used.
  void add(int i, int j, const Matrix6& block);
  Eigen::VectorXd diagonal() const;
  // Factorises the matrix plus diag(`extra`). False: not positive definite, or out of memory.
  bool factorise(const Eigen::VectorXd& extra);
  // Solves with the last factorisation; factorise() must have returned true.
  Eigen::VectorXd solve(const Eigen::VectorXd& right_side) const;

  // The matrix, both triangles, without `extra`. For tests.
  Eigen::MatrixXd dense() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace relmap
