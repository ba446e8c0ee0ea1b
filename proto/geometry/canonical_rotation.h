// Rotations in bytes: a unit quaternion that stays the same, bit for bit, when it is converted to a matrix and back.
#pragma once

#include <array>

#include "proto/geometry/geometry.h"

namespace relmap {

using QuaternionWxyz = std::array<double, 4>;

// The canonical quaternion (w, x, y, z) of a rotation, within 1e-14 rad of it. The first nonzero component is positive;
// three components are multiples of 2^-46, and the largest one completes them to unit length. For every q that it
// returns, canonical_quaternion(rotation_of(q)) == q, so equal maps give equal bytes.
// A matrix that is no rotation gives zeros, or NaN if it is not finite, so that encoding does not hide the error.
QuaternionWxyz canonical_quaternion(const Matrix3& rotation);

// The rotation of a quaternion; the zero matrix if its length is not 1 within 1e-6, and NaN if it is not finite.
Matrix3 rotation_of(const QuaternionWxyz& wxyz);

// True if R R' = I within 1e-5 and det R > 0; false for NaN.
bool is_rotation(const Matrix3& R);

}  // namespace relmap
