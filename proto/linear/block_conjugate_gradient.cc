#include "proto/linear/block_conjugate_gradient.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cassert>
#include <cmath>

namespace relmap {
namespace {

constexpr Eigen::Index kBlock = 6;
auto part(Eigen::VectorXd& x, int i) { return x.segment<kBlock>(kBlock * i); }
auto part(const Eigen::VectorXd& x, int i) { return x.segment<kBlock>(kBlock * i); }

}  // namespace

BlockConjugateGradient::BlockConjugateGradient(int blocks, const std::vector<std::pair<int, int>>& pairs)
    : diagonal_(static_cast<std::size_t>(blocks)),
      begin_(static_cast<std::size_t>(blocks) + 1, 0),
      inverse_(static_cast<std::size_t>(blocks)),
      step_(static_cast<std::size_t>(blocks)),
      chained_(static_cast<std::size_t>(blocks), false) {
  std::vector<std::pair<int, int>> unique;  // (j, i), i < j
  unique.reserve(pairs.size());
  for (const auto& [i, j] : pairs) unique.emplace_back(std::max(i, j), std::min(i, j));
  std::sort(unique.begin(), unique.end());
  unique.erase(std::unique(unique.begin(), unique.end()), unique.end());
  others_.reserve(unique.size());
  for (const auto& [j, i] : unique) {
    others_.push_back({i, j, Matrix6::Zero()});
    ++begin_[static_cast<std::size_t>(j) + 1];
    if (i + 1 == j) chained_[static_cast<std::size_t>(j)] = true;
  }
  for (std::size_t j = 1; j < begin_.size(); ++j) begin_[j] += begin_[j - 1];
  set_zero();
}

void BlockConjugateGradient::set_zero() {
  for (Matrix6& block : diagonal_) block.setZero();
  for (OffDiagonal& other : others_) other.block.setZero();
}

std::size_t BlockConjugateGradient::position(int i, int j) const {
  const auto begin = others_.begin() + static_cast<std::ptrdiff_t>(begin_[static_cast<std::size_t>(j)]),
             end = others_.begin() + static_cast<std::ptrdiff_t>(begin_[static_cast<std::size_t>(j) + 1]);
  const auto found = std::lower_bound(begin, end, i, [](const OffDiagonal& other, int row) { return other.i < row; });
  assert(found != end && found->i == i);
  return static_cast<std::size_t>(found - others_.begin());
}

void BlockConjugateGradient::add(int i, int j, const Matrix6& block) {
  if (i == j)
    diagonal_[static_cast<std::size_t>(i)] += block;
  else if (i < j)
    others_[position(i, j)].block += block;
  else
    others_[position(j, i)].block += block.transpose();
}

Eigen::VectorXd BlockConjugateGradient::diagonal() const {
  Eigen::VectorXd out(kBlock * static_cast<Eigen::Index>(diagonal_.size()));
  for (std::size_t i = 0; i < diagonal_.size(); ++i) part(out, static_cast<int>(i)) = diagonal_[i].diagonal();
  return out;
}

bool BlockConjugateGradient::factorise(const Eigen::VectorXd& extra) {
  extra_ = extra;
  for (std::size_t i = 0; i < diagonal_.size(); ++i) {
    Matrix6 pivot = diagonal_[i];
    pivot.diagonal() += part(extra_, static_cast<int>(i));
    if (chained_[i]) {
      const int block = static_cast<int>(i);
      const Matrix6& beside = others_[position(block - 1, block)].block;
      step_[i].noalias() = inverse_[i - 1] * beside;
      pivot.noalias() -= beside.transpose() * step_[i];
    }
    const Eigen::LLT<Matrix6> factor(pivot);
    if (factor.info() != Eigen::Success) return false;
    inverse_[i] = factor.solve(Matrix6::Identity());
  }
  return true;
}

void BlockConjugateGradient::multiply(const Eigen::VectorXd& x, Eigen::VectorXd& product) const {
  product = extra_.cwiseProduct(x);
  for (std::size_t j = 0; j < diagonal_.size(); ++j) {
    const Vector6 x_j = part(x, static_cast<int>(j));
    Vector6 sum = diagonal_[j] * x_j;
    for (std::size_t k = begin_[j]; k < begin_[j + 1]; ++k) {
      const OffDiagonal& other = others_[k];
      sum.noalias() += other.block.transpose() * part(x, other.i);
      part(product, other.i).noalias() += other.block * x_j;
    }
    part(product, static_cast<int>(j)) += sum;
  }
}

// Solves the system without the blocks that are on no chain.
void BlockConjugateGradient::precondition(const Eigen::VectorXd& residual, Eigen::VectorXd& out) const {
  const int blocks = static_cast<int>(diagonal_.size());
  out = residual;
  for (int i = 1; i < blocks; ++i)
    if (chained_[static_cast<std::size_t>(i)])
      part(out, i).noalias() -= step_[static_cast<std::size_t>(i)].transpose() * part(out, i - 1);
  for (int i = blocks - 1; i >= 0; --i) {
    Vector6 x = inverse_[static_cast<std::size_t>(i)] * part(out, i);
    if (i + 1 < blocks && chained_[static_cast<std::size_t>(i) + 1])
      x.noalias() -= step_[static_cast<std::size_t>(i) + 1] * part(out, i + 1);
    part(out, i) = x;
  }
}

Eigen::VectorXd BlockConjugateGradient::solve(const Eigen::VectorXd& right_side, double tolerance, int max_iterations) {
  Eigen::VectorXd x = Eigen::VectorXd::Zero(right_side.size()), residual = right_side, product, z;
  precondition(residual, z);
  Eigen::VectorXd direction = z;
  double square = residual.dot(z);
  const double enough = tolerance * tolerance * square;
  for (iterations_ = 0; iterations_ < max_iterations && square > enough; ++iterations_) {
    multiply(direction, product);
    const double curvature = direction.dot(product);
    if (!(curvature > 0)) break;  // rounding errors only are left
    const double length = square / curvature;
    x += length * direction;
    residual -= length * product;
    precondition(residual, z);
    const double next = residual.dot(z);
    direction = z + (next / square) * direction;
    square = next;
  }
  return x;
}

}  // namespace relmap
