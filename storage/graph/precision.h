// The precision with which estimates are kept: far below what any of them is known to, and a third of the bytes of
// doubles. A map rounds what was edited when it publishes it, so that what readers and the worker see is, bit for bit,
// what a reload gives.
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
  int left_out = 0;                        // 0..3: w, x, y or z; made positive
  std::array<std::int64_t, 3> rotation{};  // the others, in that order
  std::array<std::int64_t, 3> translation{};
};
// nullopt: not finite, or beyond 2^30 m.
std::optional<PoseGrid> to_grid(const SE3& T);
SE3 from_grid(const PoseGrid& grid);

// E[xi xi_previous'] in parts of what the two covariances allow, in 127ths, and back. What is not finite is zero.
std::array<std::int8_t, 36> to_correlation(const Matrix6& with_previous, const Matrix6& own, const Matrix6& previous);
Matrix6 from_correlation(const std::array<std::int8_t, 36>& correlation, const Matrix6& own, const Matrix6& previous);
// Zero: independent, or unknown.
inline bool is_zero(const std::array<std::int8_t, 36>& correlation) {
  return correlation == std::array<std::int8_t, 36>{};
}

// What cannot be rounded (not finite, out of range) is left as it is.
SE3 rounded(const SE3& T);
Matrix6 rounded(const Matrix6& m);
void round_estimates(FrameHot& frame);

}  // namespace relmap::storage
