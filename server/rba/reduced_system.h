// Solves the reduced system A x = b, A symmetric and positive definite. Small systems, as every usual update poses, are
// dense; large ones (a whole map at once) are sparse, and factored as such.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/SparseCholesky>

#include "proto/geometry.h"

namespace relmap::rba {

class ReducedSystem {
 public:
  // Factors A + lambda diag(A), of which the lower triangle is given; made of 6 x 6 blocks. False if it is not positive
  // definite.
  bool factor(const Eigen::MatrixXd& A, double lambda);

  // After factor() was true.
  Eigen::VectorXd solve(const Eigen::VectorXd& b) const;
  // The six columns of the inverse at `column` (in blocks): its 6 x 6 blocks are the covariances of all with this one.
  Eigen::MatrixXd inverse_columns(Eigen::Index column) const;

 private:
  static constexpr Eigen::Index kMostDense = 6 * 80;  // rows; about where the two cost the same

  Eigen::Index rows_ = 0;
  Eigen::MatrixXd damped_;
  Eigen::LLT<Eigen::MatrixXd, Eigen::Lower> dense_;
  Eigen::SimplicialLLT<Eigen::SparseMatrix<double>, Eigen::Lower> sparse_;
};

}  // namespace relmap::rba
