// The precision at which estimates are kept: far finer than any of them is known, and a third of the bytes of doubles.
// A map rounds what was edited when it publishes it, so that what readers and the worker see is, bit for bit, what a
// reload gives.
//
//   rotations     three parts of the unit quaternion, in steps of 2^-34 (1.2e-10 rad); the fourth, which is not small,
//                 follows from them
//   translations  in steps of 2^-27 m (7.5 nm)
//   covariances   symmetric, of floats
//   landmarks     floats (of inverse depth and bearing: 6e-8 of each)
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "proto/geometry/geometry.h"
#include "storage/graph/frame.h"

namespace relmap::storage {

struct PoseGrid {
  int left_out = 0;                           // 0..3: the part w, x, y or z, made positive
  std::array<std::int64_t, 3> rotation{};     // the other three in that order, in steps
  std::array<std::int64_t, 3> translation{};  // in steps
};
// nullopt if T is not finite, not a rotation, or beyond 2^30 m.
std::optional<PoseGrid> to_grid(const SE3& T);
SE3 from_grid(const PoseGrid& grid);

// Converts E[xi xi_previous'] to correlations in 127ths, stored by columns, and back. What is not finite becomes zero.
std::array<std::int8_t, 36> to_correlation(const Matrix6& with_previous, const Matrix6& own, const Matrix6& previous);
Matrix6 from_correlation(const std::array<std::int8_t, 36>& correlation, const Matrix6& own, const Matrix6& previous);
// Zero means independent or unknown.
inline bool is_zero(const std::array<std::int8_t, 36>& correlation) {
  return correlation == std::array<std::int8_t, 36>{};
}

// A value that cannot be rounded (not finite, out of range) is left as it is.
SE3 rounded(const SE3& T);
Matrix6 rounded(const Matrix6& m);
void round_estimates(FrameHot& frame);

}  // namespace relmap::storage
