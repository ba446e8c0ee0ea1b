// Rotations as they stand in bytes: a unit quaternion that survives the way through a matrix and back, bit for bit.
#pragma once

#include <array>

#include "proto/geometry/geometry.h"

namespace relmap {

using QuaternionWxyz = std::array<double, 4>;

// The canonical quaternion (w, x, y, z) of a rotation: the first nonzero component positive, three components on a grid
// of 2^-46, the largest completing them to unit length; within 1e-14 rad of `rotation`.
// canonical_quaternion(rotation_of(q)) == q for every q that it returned: equal maps give equal bytes.
// A matrix that is no rotation gives zeros, or NaN if it is not finite: what is wrong stays wrong on its way.
QuaternionWxyz canonical_quaternion(const Matrix3& rotation);

// The rotation of a quaternion; of one whose length is not 1 within 1e-6, the zero matrix, and NaN of one not finite.
Matrix3 rotation_of(const QuaternionWxyz& wxyz);

// R R' = I within 1e-5 and det R > 0; false for NaN.
bool is_rotation(const Matrix3& R);

}  // namespace relmap
