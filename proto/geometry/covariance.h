// Covariances of SE(3) that come from outside: their plausibility, and the 21 numbers of their upper triangle.
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

}  // namespace relmap
