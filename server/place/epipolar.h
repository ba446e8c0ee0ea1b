// Verifies two views of one place without depth: their matches must agree on a fundamental matrix or a homography.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "proto/base/status.h"
#include "proto/keyframe/keyframe.h"

namespace relmap::place {

inline constexpr int kMinEpipolarInliers = 30;

struct EpipolarMatch {
  std::vector<std::uint32_t> inliers;  // features of the query, ascending
  bool homography = false;             // whether the model is a homography rather than a fundamental matrix
};

// Matches the features of two views and fits a fundamental matrix, or a homography if that explains nearly as many
// matches: points of one plane agree with many fundamental matrices (Hartley and Zisserman 2003, 13 and 22.4). Features
// are then matched again near the position that the surrounding inliers predict, where few features look alike: views
// of one place gain inliers by this, unrelated views hardly any. TOO_FEW_INLIERS if fewer than `min_inliers` agree.
// Deterministic.
Result<EpipolarMatch> match_views(std::span<const AppearanceFeature> query, std::span<const AppearanceFeature> map,
                                  int min_inliers = kMinEpipolarInliers);

}  // namespace relmap::place
