#include "proto/linear/block_cholesky.h"

#include <cholmod.h>

#include <algorithm>
#include <cassert>
#include <new>

namespace relmap {
namespace {
constexpr int kSide = 6;
}

struct BlockCholesky::State {
  State() {
    cholmod_start(&common);
#ifdef RELMAP_CHOLMOD_SUPERNODAL
    common.supernodal = CHOLMOD_AUTO;
#else
    common.supernodal = CHOLMOD_SIMPLICIAL;
#endif
    common.final_ll = 1;  // LL' detects a matrix that is not positive definite; LDL' does not
    common.print = 0;
    common.nmethods = 1;
    common.method[0].ordering = CHOLMOD_AMD;
  }
  ~State() {
    cholmod_free_factor(&factor, &common);
    cholmod_free_sparse(&damped, &common);
    cholmod_free_sparse(&matrix, &common);
    cholmod_finish(&common);
  }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  // The position of block (i, j), i <= j, within the entries of each of its six columns.
  int row_offset(int i, int j) const {
    const auto begin = rows[j].begin();
    const auto found = std::lower_bound(begin, rows[j].end(), i);
    assert(found != rows[j].end() && *found == i);
    return kSide * static_cast<int>(found - begin);
  }
  double* values(cholmod_sparse* m) const { return static_cast<double*>(m->x); }
  int column_start(int column) const { return static_cast<const int*>(matrix->p)[column]; }
  // The diagonal block is the last one in its column.
  int diagonal_position(int column) const {
    const int block = column / kSide;
    return column_start(column) + kSide * (static_cast<int>(rows[block].size()) - 1) + column % kSide;
  }

  cholmod_common common;
  std::vector<std::vector<int>> rows;  // for each block column, its blocks in the upper triangle, ascending
  cholmod_sparse* matrix = nullptr;
  cholmod_sparse* damped = nullptr;
  cholmod_factor* factor = nullptr;
};

BlockCholesky::BlockCholesky(int blocks, const std::vector<std::pair<int, int>>& pairs)
    : state_(std::make_unique<State>()) {
  State& s = *state_;
  s.rows.resize(blocks);
  for (int j = 0; j < blocks; ++j) s.rows[j].push_back(j);
  for (const auto& [i, j] : pairs) s.rows[std::max(i, j)].push_back(std::min(i, j));
  std::size_t entries = 0;
  for (auto& column : s.rows) {
    std::sort(column.begin(), column.end());
    column.erase(std::unique(column.begin(), column.end()), column.end());
    entries += column.size() * kSide * kSide;
  }
  const auto side = static_cast<std::size_t>(blocks) * kSide;
  s.matrix =
      cholmod_allocate_sparse(side, side, entries, true, true, /*stype: upper triangle=*/1, CHOLMOD_REAL, &s.common);
  if (s.matrix == nullptr) throw std::bad_alloc();
  int* start = static_cast<int*>(s.matrix->p);
  int* row = static_cast<int*>(s.matrix->i);
  int position = 0;
  for (int j = 0; j < blocks; ++j)
    for (int c = 0; c < kSide; ++c) {
      *start++ = position;
      for (const int i : s.rows[j])
        for (int r = 0; r < kSide; ++r) row[position++] = kSide * i + r;
    }
  *start = position;
  set_zero();
  s.damped = cholmod_copy_sparse(s.matrix, &s.common);
  s.factor = cholmod_analyze(s.matrix, &s.common);
  if (s.damped == nullptr || s.factor == nullptr) throw std::bad_alloc();
}

BlockCholesky::~BlockCholesky() = default;

double BlockCholesky::work() const { return state_->common.fl; }

void BlockCholesky::set_zero() {
  std::fill_n(state_->values(state_->matrix), static_cast<const int*>(state_->matrix->p)[state_->matrix->ncol], 0.0);
}

void BlockCholesky::add(int i, int j, const Matrix6& block) {
  if (i > j) {
    add(j, i, block.transpose());
    return;
  }
  const State& s = *state_;
  const int offset = s.row_offset(i, j);
  for (int c = 0; c < kSide; ++c) {
    double* out = s.values(s.matrix) + s.column_start(kSide * j + c) + offset;
    for (int r = 0; r < kSide; ++r) out[r] += block(r, c);
  }
}

Eigen::VectorXd BlockCholesky::diagonal() const {
  const State& s = *state_;
  Eigen::VectorXd out(static_cast<Eigen::Index>(s.matrix->ncol));
  for (int k = 0; k < out.size(); ++k) out[k] = s.values(s.matrix)[s.diagonal_position(k)];
  return out;
}

bool BlockCholesky::factorise(const Eigen::VectorXd& extra) {
  State& s = *state_;
  double* values = s.values(s.damped);
  std::copy_n(s.values(s.matrix), static_cast<const int*>(s.matrix->p)[s.matrix->ncol], values);
  for (int k = 0; k < extra.size(); ++k) values[s.diagonal_position(k)] += extra[k];
  s.common.status = CHOLMOD_OK;
  return cholmod_factorize(s.damped, s.factor, &s.common) != 0 && s.common.status == CHOLMOD_OK &&
         s.factor->minor == s.factor->n;
}

Eigen::MatrixXd BlockCholesky::dense() const {
  const State& s = *state_;
  const auto side = static_cast<Eigen::Index>(s.matrix->ncol);
  Eigen::MatrixXd whole = Eigen::MatrixXd::Zero(side, side);
  const int* row = static_cast<const int*>(s.matrix->i);
  for (int column = 0; column < side; ++column)
    for (int k = s.column_start(column); k < s.column_start(column + 1); ++k)
      if (row[k] <= column) whole(row[k], column) = whole(column, row[k]) = s.values(s.matrix)[k];
  return whole;
}

Eigen::VectorXd BlockCholesky::solve(const Eigen::VectorXd& right_side) const {
  State& s = *state_;
  const auto side = static_cast<std::size_t>(right_side.size());
  cholmod_dense b{};
  b.nrow = b.nzmax = b.d = side;
  b.ncol = 1;
  b.x = const_cast<double*>(right_side.data());
  b.xtype = CHOLMOD_REAL;
  b.dtype = CHOLMOD_DOUBLE;
  cholmod_dense* x = cholmod_solve(CHOLMOD_A, s.factor, &b, &s.common);
  if (x == nullptr) throw std::bad_alloc();
  const Eigen::VectorXd out = Eigen::Map<const Eigen::VectorXd>(static_cast<const double*>(x->x), right_side.size());
  cholmod_free_dense(&x, &s.common);
  return out;
}

}  // namespace relmap
