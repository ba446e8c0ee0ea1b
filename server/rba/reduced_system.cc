#include "server/rba/reduced_system.h"

#include <Eigen/Cholesky>
#include <algorithm>

namespace relmap::rba {

void ReducedSystem::reset(std::int32_t size, std::span<const std::pair<std::int32_t, std::int32_t>> pattern) {
  size_ = size;
  right_side_.resize(static_cast<std::size_t>(size));
  if (is_dense()) {
    blocks_.resize(static_cast<std::size_t>(size) * (static_cast<std::size_t>(size) + 1) / 2);
    return;
  }
  std::vector<std::pair<int, int>> sorted(pattern.begin(), pattern.end());
  std::sort(sorted.begin(), sorted.end());
  sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
  if (sparse_ && sparse_size_ == size && sorted == pattern_) return;
  pattern_ = std::move(sorted);
  sparse_size_ = size;
  sparse_ = std::make_unique<BlockCholesky>(size, pattern_);
}

void ReducedSystem::clear() {
  std::fill(right_side_.begin(), right_side_.end(), Vector6::Zero());
  if (is_dense())
    std::fill(blocks_.begin(), blocks_.end(), Matrix6::Zero());
  else
    sparse_->set_zero();
}

void ReducedSystem::add(std::int32_t row, std::int32_t column, const Matrix6& block) {
  if (is_dense())
    blocks_[at(row, column)] += block;
  else
    sparse_->add(row, column, block);
}

Eigen::MatrixXd ReducedSystem::dense() const {
  if (!is_dense()) return sparse_->dense();
  Eigen::MatrixXd whole(6 * size_, 6 * size_);
  for (std::int32_t column = 0; column < size_; ++column)
    for (std::int32_t row = column; row < size_; ++row) {
      whole.block<6, 6>(6 * row, 6 * column) = blocks_[at(row, column)];
      whole.block<6, 6>(6 * column, 6 * row) = blocks_[at(row, column)].transpose();
    }
  return whole;
}

Eigen::VectorXd ReducedSystem::dense_right_side() const {
  Eigen::VectorXd whole(6 * size_);
  for (std::int32_t row = 0; row < size_; ++row) whole.segment<6>(6 * row) = right_side_[row];
  return whole;
}

bool ReducedSystem::factor(double lambda) {
  if (is_dense()) return factor_dense(lambda);
  return sparse_->factorise(lambda * sparse_->diagonal());
}

// Right-looking block Cholesky. The diagonal blocks are stored inverted: one triangular inverse for each turns all
// other divisions into products of fixed size.
bool ReducedSystem::factor_dense(double lambda) {
  factor_ = blocks_;
  for (std::int32_t k = 0; k < size_; ++k) factor_[at(k, k)].diagonal() *= 1 + lambda;
  for (std::int32_t k = 0; k < size_; ++k) {
    Matrix6& corner = factor_[at(k, k)];
    const Eigen::LLT<Matrix6> cholesky(corner.selfadjointView<Eigen::Lower>());
    if (cholesky.info() != Eigen::Success) return false;
    corner.setIdentity();
    cholesky.matrixL().solveInPlace(corner);
    const Matrix6 inverse_transposed = corner.transpose();
    Matrix6* const column = &factor_[at(k, k)] - k;  // column[row]
    for (std::int32_t row = k + 1; row < size_; ++row) column[row] = column[row].lazyProduct(inverse_transposed).eval();
    for (std::int32_t c = k + 1; c < size_; ++c) {
      const Matrix6 transposed = column[c].transpose();
      Matrix6* const target = &factor_[at(c, c)] - c;
      for (std::int32_t row = c; row < size_; ++row) target[row].noalias() -= column[row].lazyProduct(transposed);
    }
  }
  return true;
}

template <typename Block>
void ReducedSystem::substitute(std::int32_t first, std::vector<Block>* y) const {
  for (std::int32_t k = first; k < size_; ++k) {
    const Matrix6* const column = &factor_[at(k, k)] - k;
    (*y)[k] = (column[k].template triangularView<Eigen::Lower>() * (*y)[k]).eval();
    for (std::int32_t row = k + 1; row < size_; ++row) (*y)[row].noalias() -= column[row] * (*y)[k];
  }
  for (std::int32_t k = size_ - 1; k >= 0; --k) {
    const Matrix6* const column = &factor_[at(k, k)] - k;
    for (std::int32_t row = k + 1; row < size_; ++row) (*y)[k].noalias() -= column[row].transpose() * (*y)[row];
    (*y)[k] = (column[k].template triangularView<Eigen::Lower>().transpose() * (*y)[k]).eval();
  }
}

void ReducedSystem::solve(std::vector<Vector6>* x) {
  *x = right_side_;
  if (is_dense()) return substitute(0, x);
  const Eigen::VectorXd solved = sparse_->solve(dense_right_side());
  for (std::int32_t row = 0; row < size_; ++row) (*x)[row] = solved.segment<6>(6 * row);
}

void ReducedSystem::inverse_column(std::int32_t column, std::vector<Matrix6>* blocks) {
  blocks->assign(static_cast<std::size_t>(size_), Matrix6::Zero());
  if (is_dense()) {
    (*blocks)[column].setIdentity();
    return substitute(column, blocks);
  }
  for (int k = 0; k < 6; ++k) {
    const Eigen::VectorXd solved = sparse_->solve(Eigen::VectorXd::Unit(6 * size_, 6 * column + k));
    for (std::int32_t row = 0; row < size_; ++row) (*blocks)[row].col(k) = solved.segment<6>(6 * row);
  }
}

}  // namespace relmap::rba
