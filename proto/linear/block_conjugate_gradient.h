// Solves large sparse symmetric positive definite systems of 6x6 blocks approximately, by conjugate gradients (Hestenes
// and Stiefel 1952), in memory and time proportional to the number of blocks.
//
// It is made for the systems of pose graphs, whose stiff blocks are those between consecutive unknowns: frames of one
// robot's way. The preconditioner solves these chains exactly, so that an error travels along a whole way in one
// iteration, and only what joins different places of ways is left to the iterations.
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "proto/geometry/geometry.h"

namespace relmap {

// The sparsity pattern is fixed; values may be set and solved for any number of times, as with BlockCholesky.
// Not thread-safe; different objects may be used by different threads.
class BlockConjugateGradient {
 public:
  // `pairs`: the blocks (i, j), i != j, that may be non-zero; (i, j) and (j, i) are the same, and repeats are allowed.
  BlockConjugateGradient(int blocks, const std::vector<std::pair<int, int>>& pairs);

  void set_zero();
  // Adds `block` at (i, j) and, for i != j, its transpose at (j, i).
  void add(int i, int j, const Matrix6& block);
  Eigen::VectorXd diagonal() const;
  // Prepares solve() for the matrix plus diag(`extra`). False: the chains, and so the matrix, are not positive
  // definite.
  bool factorise(const Eigen::VectorXd& extra);
  // Solves until the residual, in the norm of the preconditioner, has fallen to `tolerance` of what it was, or for
  // `max_iterations`. factorise() must have returned true. What it returns lowers the quadratic form in any case.
  Eigen::VectorXd solve(const Eigen::VectorXd& right_side, double tolerance, int max_iterations);

  int iterations() const { return iterations_; }  // of the last solve()

 private:
  struct OffDiagonal {
    int i = 0, j = 0;  // i < j
    Matrix6 block;
  };
  std::size_t position(int i, int j) const;
  void multiply(const Eigen::VectorXd& x, Eigen::VectorXd& product) const;
  void precondition(const Eigen::VectorXd& residual, Eigen::VectorXd& out) const;

  std::vector<Matrix6> diagonal_;
  std::vector<OffDiagonal> others_;  // ascending by j, then i
  std::vector<std::size_t> begin_;   // by j: of its blocks in `others_`; one more at the end
  Eigen::VectorXd extra_;            // on the diagonal
  std::vector<Matrix6> inverse_;     // by block: the inverse of its pivot within its chain
  std::vector<Matrix6> step_;        // by block: inverse_[i - 1] * A(i - 1, i)
  std::vector<bool> chained_;        // by block: A(i - 1, i) may be non-zero
  int iterations_ = 0;
};

}  // namespace relmap
