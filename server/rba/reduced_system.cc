#include "server/rba/reduced_system.h"

#include <Eigen/Cholesky>
#include <Eigen/CholmodSupport>
#include <algorithm>

namespace relmap::rba {

struct ReducedSystem::Sparse {
  Sparse() {
    solver.cholmod().print = 0;  // that a system is not positive definite is an answer
  }

  // Blocks by column, the one on the diagonal first, then ascending by row.
  std::vector<std::int32_t> first, rows;
  Eigen::SparseMatrix<double> A;  // its lower triangle
  Eigen::CholmodSupernodalLLT<Eigen::SparseMatrix<double>, Eigen::Lower> solver;
  bool analysed = false;

  void set_pattern(std::int32_t size, std::span<const std::pair<std::int32_t, std::int32_t>> pattern) {
    std::vector<std::pair<std::int32_t, std::int32_t>> by_column;  // (column, row)
    by_column.reserve(pattern.size() + static_cast<std::size_t>(size));
    for (std::int32_t c = 0; c < size; ++c) by_column.emplace_back(c, c);
    for (const auto& [row, column] : pattern) by_column.emplace_back(column, row);
    std::sort(by_column.begin(), by_column.end());
    by_column.erase(std::unique(by_column.begin(), by_column.end()), by_column.end());
    std::vector<std::int32_t> now_first(static_cast<std::size_t>(size) + 1, 0), now_rows;
    for (const auto& [column, row] : by_column) {
      now_rows.push_back(row);
      now_first[static_cast<std::size_t>(column) + 1] = static_cast<std::int32_t>(now_rows.size());
    }
    if (analysed && now_first == first && now_rows == rows) return;
    first = std::move(now_first);
    rows = std::move(now_rows);
    analysed = false;
  }

  // The blocks as columns of numbers.
  void fill(const std::vector<Matrix6>& blocks, double lambda) {
    const auto size = static_cast<Eigen::Index>(first.size()) - 1;
    if (!analysed) {
      A.resize(6 * size, 6 * size);
      std::vector<Eigen::Triplet<double>> entries;
      entries.reserve(36 * blocks.size());
      for_each_entry(blocks,
                     [&](Eigen::Index row, Eigen::Index column, double) { entries.emplace_back(row, column, 1); });
      A.setFromTriplets(entries.begin(), entries.end());
    }
    double* value = A.valuePtr();
    for_each_entry(blocks, [&](Eigen::Index row, Eigen::Index column, double entry) {
      *value++ = row == column ? (1 + lambda) * entry : entry;
    });
  }

 private:
  // In the order in which a sparse matrix keeps them.
  template <typename Visit>
  void for_each_entry(const std::vector<Matrix6>& blocks, Visit visit) const {
    for (std::size_t c = 0; c + 1 < first.size(); ++c)
      for (Eigen::Index k = 0; k < 6; ++k)
        for (std::int32_t n = first[c]; n < first[c + 1]; ++n)
          for (Eigen::Index r = n == first[c] ? k : 0; r < 6; ++r)
            visit(6 * rows[n] + r, 6 * static_cast<Eigen::Index>(c) + k, blocks[n](r, k));
  }
};

ReducedSystem::ReducedSystem() = default;
ReducedSystem::~ReducedSystem() = default;

void ReducedSystem::reset(std::int32_t size, std::span<const std::pair<std::int32_t, std::int32_t>> pattern) {
  size_ = size;
  std::size_t blocks = static_cast<std::size_t>(size) * (static_cast<std::size_t>(size) + 1) / 2;
  if (!is_dense()) {
    if (!sparse_) sparse_ = std::make_unique<Sparse>();
    sparse_->set_pattern(size, pattern);
    blocks = sparse_->rows.size();
  }
  blocks_.resize(blocks);
  right_side_.resize(static_cast<std::size_t>(size));
}

void ReducedSystem::clear() {
  std::fill(blocks_.begin(), blocks_.end(), Matrix6::Zero());
  std::fill(right_side_.begin(), right_side_.end(), Vector6::Zero());
}

std::size_t ReducedSystem::at(std::int32_t row, std::int32_t column) const {
  if (is_dense()) return static_cast<std::size_t>(column * size_ - column * (column + 1) / 2 + row);
  const auto begin = sparse_->rows.begin() + sparse_->first[column];
  const auto end = sparse_->rows.begin() + sparse_->first[static_cast<std::size_t>(column) + 1];
  return static_cast<std::size_t>(std::lower_bound(begin, end, row) - sparse_->rows.begin());
}

Eigen::MatrixXd ReducedSystem::dense() const {
  Eigen::MatrixXd whole = Eigen::MatrixXd::Zero(6 * size_, 6 * size_);
  const auto put = [&](std::int32_t row, std::int32_t column, const Matrix6& block) {
    if (row == column) {
      whole.block<6, 6>(6 * row, 6 * row) = block.selfadjointView<Eigen::Lower>();
      return;
    }
    whole.block<6, 6>(6 * row, 6 * column) = block;
    whole.block<6, 6>(6 * column, 6 * row) = block.transpose();
  };
  for (std::int32_t column = 0; column < size_; ++column) {
    if (is_dense())
      for (std::int32_t row = column; row < size_; ++row) put(row, column, blocks_[at(row, column)]);
    else
      for (std::int32_t n = sparse_->first[column]; n < sparse_->first[column + 1]; ++n)
        put(sparse_->rows[n], column, blocks_[n]);
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
  sparse_->fill(blocks_, lambda);
  if (!sparse_->analysed) sparse_->solver.analyzePattern(sparse_->A);
  sparse_->analysed = true;
  sparse_->solver.factorize(sparse_->A);
  return sparse_->solver.info() == Eigen::Success;
}

// Right-looking, block by block. The blocks on the diagonal are kept inverted: one triangular inverse for each turns
// all other divisions into products of fixed size.
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
  const Eigen::VectorXd solved = sparse_->solver.solve(dense_right_side());
  for (std::int32_t row = 0; row < size_; ++row) (*x)[row] = solved.segment<6>(6 * row);
}

void ReducedSystem::inverse_column(std::int32_t column, std::vector<Matrix6>* blocks) {
  blocks->assign(static_cast<std::size_t>(size_), Matrix6::Zero());
  if (is_dense()) {
    (*blocks)[column].setIdentity();
    return substitute(column, blocks);
  }
  Eigen::MatrixXd unit = Eigen::MatrixXd::Zero(6 * size_, 6);
  unit.middleRows<6>(6 * column).setIdentity();
  const Eigen::MatrixXd solved = sparse_->solver.solve(unit);
  for (std::int32_t row = 0; row < size_; ++row) (*blocks)[row] = solved.middleRows<6>(6 * row);
}

}  // namespace relmap::rba
