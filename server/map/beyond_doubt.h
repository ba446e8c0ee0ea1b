// A robot that crosses an old path sees it from one frame only, so no second closure can agree with the first. Such a
// closure is accepted alone if its geometry cannot have come about by chance (docs/method.md, 7).
#pragma once

#include "storage/graph/frame.h"

namespace relmap::map {

// Whether the geometry of a lone closure is beyond doubt: many inliers spread over the picture, a high probability by
// appearance, and no other place that comes near. False if uniqueness has not been measured (Uniqueness::known).
inline bool is_beyond_doubt(const storage::Edge& closure) {
  constexpr int kInliers = 80;
  constexpr float kSpread = 0.3f;
  constexpr float kProbability = 0.9f;
  constexpr float kRival = 0.3f;        // inliers at the best place elsewhere, as a share of those here
  constexpr float kDifference = 0.25f;  // share of what both views should show that differs
  const storage::Uniqueness& unique = closure.uniqueness;
  return closure.verification == storage::Verification::kStereo && closure.inliers >= kInliers &&
         closure.spread >= kSpread && closure.probability >= kProbability && unique.known && unique.alike == 0 &&
         unique.differs >= 0 && unique.runner_up_inliers <= kRival * static_cast<float>(closure.inliers) &&
         unique.differs <= kDifference;
}

}  // namespace relmap::map
