// A robot that crosses an old path sees it from one frame only, and nothing else can agree with that. Such a closure is
// believed alone where chance cannot have made it (docs/method.md, 7).
#pragma once

#include "storage/graph/frame.h"

namespace relmap::map {

// Whether the geometry of a lone closure alone is beyond doubt: many inliers all over the picture, of a place that
// appearance is sure of, and nothing elsewhere that comes near it. Not where that is not known (Uniqueness::known).
inline bool is_beyond_doubt(const storage::Edge& closure) {
  constexpr int kInliers = 80;
  constexpr float kSpread = 0.3f;
  constexpr float kProbability = 0.9f;
  constexpr float kRival = 0.3f;        // share of the inliers, at the best place elsewhere
  constexpr float kDifference = 0.25f;  // share of what both views should show
  const storage::Uniqueness& unique = closure.uniqueness;
  return closure.verification == storage::Verification::kStereo && closure.inliers >= kInliers &&
         closure.spread >= kSpread && closure.probability >= kProbability && unique.known && unique.alike == 0 &&
         unique.differs >= 0 && unique.runner_up_inliers <= kRival * static_cast<float>(closure.inliers) &&
         unique.differs <= kDifference;
}

}  // namespace relmap::map
