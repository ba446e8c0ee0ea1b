// The reduced system A x = b of a bundle adjustment: A symmetric and positive definite, of 6 x 6 blocks, a row of
// blocks for each edge that moves. Small systems, as every usual update poses, are dense and factored here, in place
// and without asking for memory; large ones (a whole map at once) are sparse, and CHOLMOD's, whose symbolic analysis is
// kept while the pattern is the same.
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
  static constexpr std::int32_t kMaxDense = 80;  // blocks in a row; about where the two cost the same

  // Begins a system of so many rows of blocks. If there are more than kMaxDense, `pattern` has the blocks (row,
  // column), row > column, that may be added to, each once or more; else it is not looked at.
  void reset(std::int32_t size, std::span<const std::pair<std::int32_t, std::int32_t>> pattern = {});
  std::int32_t size() const { return size_; }
  // All blocks and right sides to zero.
  void clear();

  // Adds to the block (row, column), row >= column; on the diagonal `block` is symmetric.
  void add(std::int32_t row, std::int32_t column, const Matrix6& block);
  Vector6& right_side(std::int32_t row) { return right_side_[row]; }
  // What stands there, whole: for tests.
  Eigen::MatrixXd dense() const;
  Eigen::VectorXd dense_right_side() const;

  // Factors A + lambda diag(A). False if it is not positive definite.
  bool factor(double lambda);
  // After factor() was true. Six rows of x a block.
  void solve(std::vector<Vector6>* x);
  // The column of the inverse at `column`: its blocks are the covariances of all with this one.
  void inverse_column(std::int32_t column, std::vector<Matrix6>* blocks);

 private:
  bool is_dense() const { return size_ <= kMaxDense; }
  std::size_t at(std::int32_t row, std::int32_t column) const {  // in blocks_
    return static_cast<std::size_t>(column * size_ - column * (column + 1) / 2 + row);
  }
  bool factor_dense(double lambda);
  // L y = y, from row `first` on, and L' y = y.
  template <typename Block>
  void substitute(std::int32_t first, std::vector<Block>* y) const;

  std::int32_t size_ = 0;
  std::vector<Vector6> right_side_;
  // Of a dense system the lower triangle by columns, and L in the same order, its blocks on the diagonal inverted.
  std::vector<Matrix6> blocks_, factor_;
  // Of a sparse one.
  std::vector<std::pair<int, int>> pattern_;  // ascending, each once
  std::unique_ptr<BlockCholesky> sparse_;     // with this pattern
  std::int32_t sparse_size_ = 0;
};

}  // namespace relmap::rba
