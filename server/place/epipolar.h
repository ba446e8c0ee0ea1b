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

// Two features that look alike.
struct FeaturePair {
  std::uint32_t query = 0, map = 0;
  bool inlier = false;  // it agrees with the geometry that was found
};

// Matches the features of two views and fits a fundamental matrix, or a homography if that explains nearly as many
// matches: points of one plane agree with many fundamental matrices (Hartley and Zisserman 2003, 13 and 22.4). Features
// are then matched again near the position that the surrounding inliers predict, where few features look alike: views
// of one place gain inliers by this, unrelated views hardly any. TOO_FEW_INLIERS if fewer than `min_inliers` agree.
// Deterministic. `pairs`, if given, receives all that look alike, also if too few agree.
Result<EpipolarMatch> match_views(std::span<const AppearanceFeature> query, std::span<const AppearanceFeature> map,
                                  int min_inliers = kMinEpipolarInliers, std::vector<FeaturePair>* pairs = nullptr);

}  // namespace relmap::place
