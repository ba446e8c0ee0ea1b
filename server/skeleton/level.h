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

// A frame is not kept for a bend that is smaller than this share of the way in its chunk. So a street and a room are
// drawn equally well, each at its own scale.
inline constexpr double tolerance(std::uint32_t level) {
  constexpr double kShares[kLevels] = {0.02, 0.005, 0.001, 0};
  return kShares[level];
}

}  // namespace relmap::skeleton
