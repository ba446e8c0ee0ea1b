// The reduced system A x = b of a bundle adjustment. A is symmetric and positive definite and consists of 6 x 6 blocks,
// with one row of blocks for each edge that moves. Small systems, as of every usual update, are dense and factored here
// without allocating; large ones (a whole map at once) are sparse and factored by CHOLMOD, whose symbolic analysis is
// reused while the pattern stays the same.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "proto/geometry/geometry.h"
#include "proto/linear/block_cholesky.h"

namespace relmap::rba {

class ReducedSystem {
 public:
  static constexpr std::int32_t kMaxDense = 80;  // rows of blocks; dense and sparse cost about the same there

  // Begins a system of `size` rows of blocks. Above kMaxDense, `pattern` must list the blocks (row, column) with
  // row > column that add() may be called for, in any order and with repeats allowed; up to kMaxDense it is ignored.
  void reset(std::int32_t size, std::span<const std::pair<std::int32_t, std::int32_t>> pattern = {});
  std::int32_t size() const { return size_; }
  // Sets all blocks and right sides to zero.
  void clear();

  // Adds to the block (row, column) with row >= column. On the diagonal `block` must be symmetric.
  void add(std::int32_t row, std::int32_t column, const Matrix6& block);
  Vector6& right_side(std::int32_t row) { return right_side_[row]; }
  // The system as dense matrices, for tests.
  Eigen::MatrixXd dense() const;
  Eigen::VectorXd dense_right_side() const;

  // Factors A + lambda diag(A). False if it is not positive definite.
  bool factor(double lambda);
  // Solves for x, one element per row of blocks. Call only after factor() returned true, like inverse_column().
  void solve(std::vector<Vector6>* x);
  // A column of blocks of the inverse: the covariances of all unknowns with those of `column`.
  void inverse_column(std::int32_t column, std::vector<Matrix6>* blocks);

 private:
  bool is_dense() const { return size_ <= kMaxDense; }
  std::size_t at(std::int32_t row, std::int32_t column) const {  // in blocks_
    return static_cast<std::size_t>(column * size_ - column * (column + 1) / 2 + row);
  }
  bool factor_dense(double lambda);
  // Solves L L' z = y in place, where the rows of y before `first` are zero.
  template <typename Block>
  void substitute(std::int32_t first, std::vector<Block>* y) const;

  std::int32_t size_ = 0;
  std::vector<Vector6> right_side_;
  // Dense: the lower triangle by columns, and L in the same order with the blocks on its diagonal inverted.
  std::vector<Matrix6> blocks_, factor_;
  // Sparse:
  std::vector<std::pair<int, int>> pattern_;  // ascending, without repeats
  std::unique_ptr<BlockCholesky> sparse_;     // with this pattern
  std::int32_t sparse_size_ = 0;
};

}  // namespace relmap::rba
