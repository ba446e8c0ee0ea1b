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
};

// TOO_FEW_INLIERS. Deterministic.
Result<EpipolarMatch> match_views(std::span<const AppearanceFeature> query, std::span<const AppearanceFeature> map);

}  // namespace relmap
