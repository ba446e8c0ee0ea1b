// How much of a map a skeleton keeps. Levels are numbers of the protocol (proto/relmap/v1/skeleton.proto).
#pragma once

#include <cstdint>

#include "storage/graph/frame.h"

namespace relmap::skeleton {

inline constexpr std::uint32_t kLevels = 4, kAll = kLevels - 1;

// At most one of so many frames is kept beside those that must be.
inline constexpr std::uint32_t stride(std::uint32_t level) {
  constexpr std::uint32_t kStrides[kLevels] = {storage::kFramesPerChunk, 16, 4, 1};
  return kStrides[level];
}

// Closures of the same state that join the same two stretches of so many frames, aligned to multiples of it, are alike:
// one of them is told, and the most suspicious one if it is suspicious. The newer stretch is no longer than a chunk. A
// closure costs as much as five points, since its ends are points, too, and a map has about one for each place at which
// two robots were; so these stretches decide how large a skeleton is.
inline constexpr std::uint32_t closure_stretch(std::uint32_t level) {
  constexpr std::uint32_t kStretches[kLevels] = {8 * storage::kFramesPerChunk, storage::kFramesPerChunk, 16, 1};
  return kStretches[level];
}

// A frame is not kept for a bend that is smaller than this share of the way in its chunk. So a street and a room are
// drawn equally well, each at its own scale.
inline constexpr double tolerance(std::uint32_t level) {
  constexpr double kShares[kLevels] = {0.02, 0.005, 0.001, 0};
  return kShares[level];
}

}  // namespace relmap::skeleton
