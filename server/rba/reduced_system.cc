#include "server/rba/reduced_system.h"

#include <vector>

namespace relmap::rba {

namespace {

// The blocks of the lower triangle that are not zero.
Eigen::SparseMatrix<double> sparse_lower(const Eigen::MatrixXd& A) {
  std::vector<Eigen::Triplet<double>> entries;
  for (Eigen::Index column = 0; column < A.cols(); column += 6)
    for (Eigen::Index row = column; row < A.rows(); row += 6) {
      if (A.block<6, 6>(row, column).isZero(0)) continue;
      for (int c = 0; c < 6; ++c)
        for (int r = row == column ? c : 0; r < 6; ++r)
          entries.emplace_back(row + r, column + c, A(row + r, column + c));
    }
  Eigen::SparseMatrix<double> sparse(A.rows(), A.cols());
  sparse.setFromTriplets(entries.begin(), entries.end());
  return sparse;
}

}  // namespace

bool ReducedSystem::factor(const Eigen::MatrixXd& A, double lambda) {
  rows_ = A.rows();
  if (rows_ <= kMostDense) {
    damped_ = A;
    damped_.diagonal() *= 1 + lambda;
    dense_.compute(damped_);
    return dense_.info() == Eigen::Success;
  }
  Eigen::SparseMatrix<double> damped = sparse_lower(A);
  damped.diagonal() *= 1 + lambda;
  sparse_.compute(damped);
  return sparse_.info() == Eigen::Success;
}

Eigen::VectorXd ReducedSystem::solve(const Eigen::VectorXd& b) const {
  if (rows_ <= kMostDense) return dense_.solve(b);
  return sparse_.solve(b);
}

Eigen::MatrixXd ReducedSystem::inverse_columns(Eigen::Index column) const {
  Eigen::MatrixXd unit = Eigen::MatrixXd::Zero(rows_, 6);
  unit.middleRows<6>(6 * column).setIdentity();
  if (rows_ > kMostDense) return sparse_.solve(unit);
  dense_.solveInPlace(unit);
  return unit;
}

}  // namespace relmap::rba
