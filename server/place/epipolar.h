// Two views of one place without any depth: do their matches agree on a fundamental matrix or a homography?
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
  bool homography = false;             // else a fundamental matrix
};

// Whichever more matches agree with; where they show one plane, which any of many fundamental matrices explains, the
// homography (Hartley and Zisserman 2003, 13 and 22.4). What lies near where the inliers around it say that it should
// is matched again, as among so little few look alike: of one place more agree then, by chance hardly more.
// TOO_FEW_INLIERS: fewer than `fewest` agree. Deterministic.
Result<EpipolarMatch> match_views(std::span<const AppearanceFeature> query, std::span<const AppearanceFeature> map,
                                  int fewest = kMinEpipolarInliers);

}  // namespace relmap::place
