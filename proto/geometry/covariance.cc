#include "proto/geometry/covariance.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <string>

#include "proto/base/number_text.h"

namespace relmap {

UpperTriangle upper_triangle(const Matrix6& symmetric) {
  UpperTriangle values;
  std::size_t i = 0;
  for (int row = 0; row < 6; ++row)
    for (int column = row; column < 6; ++column) values[i++] = symmetric(row, column);
  return values;
}

Matrix6 from_upper_triangle(const UpperTriangle& values) {
  Matrix6 m;
  std::size_t i = 0;
  for (int row = 0; row < 6; ++row)
    for (int column = row; column < 6; ++column) m(row, column) = m(column, row) = values[i++];
  return m;
}

Status check_covariance(const Matrix6& covariance) {
  if (!covariance.allFinite()) return {Reason::NOT_FINITE, "covariance is not finite"};
  const Vector6 variance = covariance.diagonal();
  for (int i = 0; i < 6; ++i)
    if (!(variance[i] >= 1e-18 && variance[i] <= 1e12))
      return {Reason::BAD_COVARIANCE,
              "variance " + std::to_string(i) + " is " + number_text(variance[i]) + (i < 3 ? " m2" : " rad2")};
  const Vector6 scale = variance.cwiseSqrt().cwiseInverse();
  const Matrix6 correlation = scale.asDiagonal() * covariance * scale.asDiagonal();
  if ((correlation - correlation.transpose()).cwiseAbs().maxCoeff() > 1e-9)
    return {Reason::BAD_COVARIANCE, "covariance is not symmetric"};
  const Eigen::LLT<Matrix6> llt(correlation);
  // A squared diagonal element of L is the share of a coordinate's variance that those before it leave unexplained.
  if (llt.info() != Eigen::Success || llt.matrixLLT().diagonal().minCoeff() < 3.2e-5)
    return {Reason::BAD_COVARIANCE, "covariance is not positive definite"};
  return {};
}

namespace {

// |L^-1 error|^2 with covariance = L L^T (Cholesky, row by row). Gates of single pixels and points are tested by the
// hundred thousand, and Eigen's solvers, which pivot, take ten times as long for so few rows.
template <int N>
double whitened_squared_norm(const Eigen::Matrix<double, N, 1>& error, const Eigen::Matrix<double, N, N>& covariance) {
  double L[N][N], white[N], sum = 0;
  for (int row = 0; row < N; ++row) {
    double rest = error[row];
    for (int column = 0; column <= row; ++column) {
      double value = covariance(row, column);
      for (int k = 0; k < column; ++k) value -= L[row][k] * L[column][k];
      L[row][column] = column < row ? value / L[column][column] : std::sqrt(value);
      if (column < row) rest -= L[row][column] * white[column];
    }
    white[row] = rest / L[row][row];
    sum += white[row] * white[row];
  }
  return sum;
}

}  // namespace

double mahalanobis_squared(const Vector2& error, const Eigen::Matrix2d& covariance) {
  return whitened_squared_norm<2>(error, covariance);
}

double mahalanobis_squared(const Vector3& error, const Matrix3& covariance) {
  return whitened_squared_norm<3>(error, covariance);
}

// Not a template, so that Eigen's solver is compiled here only.
double mahalanobis_squared(const Vector6& error, const Matrix6& covariance) {
  return error.dot(covariance.ldlt().solve(error));
}

}  // namespace relmap
