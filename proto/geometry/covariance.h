// Covariances: the distance of an error in units of one, the plausibility of those that come from outside, and the 21
// numbers of the upper triangle.
#pragma once

#include <array>

#include "proto/base/status.h"
#include "proto/geometry/geometry.h"

namespace relmap {

// Row by row: (0,0), (0,1) ... (0,5), (1,1) ... (5,5).
using UpperTriangle = std::array<double, 21>;

UpperTriangle upper_triangle(const Matrix6& symmetric);
Matrix6 from_upper_triangle(const UpperTriangle& values);

// NOT_FINITE; BAD_COVARIANCE unless the covariance is symmetric (correlations within 1e-9), its standard deviations are
// 1e-9 .. 1e6 m or rad, and it is positive definite: each coordinate keeps at least 1e-9 of its variance when those
// before it are given.
Status check_covariance(const Matrix6& covariance);

// The squared Mahalanobis distance of `error` from zero: error^T covariance^-1 error. It is chi-squared distributed
// with as many degrees of freedom as `error` has components if the error is Gaussian with this covariance. The result
// means nothing if the covariance is not positive definite; it may be negative or NaN then.
double mahalanobis_squared(const Vector2& error, const Eigen::Matrix2d& covariance);
double mahalanobis_squared(const Vector3& error, const Matrix3& covariance);
double mahalanobis_squared(const Vector6& error, const Matrix6& covariance);

}  // namespace relmap
