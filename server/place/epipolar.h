// Two views of one place without any depth: do their matches agree on a fundamental matrix or a homography?
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "proto/keyframe.h"
#include "proto/status.h"

namespace relmap {

inline constexpr int kMinEpipolarInliers = 30;

struct EpipolarMatch {
  std::vector<std::uint32_t> inliers;  // features of the query, ascending
  bool homography = false;             // else a fundamental matrix
};

// Whichever more matches agree with; where they show one plane, which any of many fundamental matrices explains, the
// homography (Hartley and Zisserman 2003, 13 and 22.4). TOO_FEW_INLIERS. Deterministic.
Result<EpipolarMatch> match_views(std::span<const AppearanceFeature> query, std::span<const AppearanceFeature> map);

}  // namespace relmap
