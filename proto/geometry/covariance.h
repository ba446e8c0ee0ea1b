// Covariances of SE(3) from outside: plausibility, and the 21 numbers of their upper triangle.
#pragma once

#include <array>

#include "proto/base/status.h"
#include "proto/geometry/geometry.h"

namespace relmap {

// Row by row: (0,0), (0,1) ... (0,5), (1,1) ... (5,5).
using UpperTriangle = std::array<double, 21>;

UpperTriangle upper_triangle(const Matrix6& symmetric);
Matrix6 from_upper_triangle(const UpperTriangle& values);

// NOT_FINITE; BAD_COVARIANCE unless symmetric (within 1e-9 of its diagonal) and positive definite with correlations
// that leave each coordinate at least 1e-9 of its variance given the others, standard deviations 1e-9 .. 1e6.
Status check_covariance(const Matrix6& covariance);

}  // namespace relmap
