// Holds back the first keyframes of a recording until it is known that the recording can be tracked.
#pragma once

#include <cstddef>
#include <vector>

#include "frontend/console.h"
#include "frontend/workflow/delivery.h"
#include "proto/base/status.h"
#include "proto/keyframe/keyframe.h"

namespace relmap::workflow {

inline constexpr std::size_t kMaxHeldBack = 256;  // keyframes

// A session exists in the map from its first keyframe on. So no keyframe is sent of a recording in which no pair could
// be tracked from another. Not thread-safe.
class HeldBack {
 public:
  // Both must outlive this. `summary.tracked` is the number of pairs tracked so far; the first pair always counts.
  HeldBack(Delivery& delivery, const frontend::RunSummary& summary) : delivery_(delivery), summary_(summary) {}

  // Holds the keyframe back until a pair was tracked from another one; from then on passes all keyframes to the
  // delivery, in order. untracked()'s reasons if kMaxHeldBack keyframes are held and no pair was; the delivery's.
  Status push(Keyframe keyframe);
  // Passes on all keyframes that are held. For the end of a recording that has only one pair.
  Status release();

 private:
  Delivery& delivery_;
  const frontend::RunSummary& summary_;
  std::vector<Keyframe> waiting_;
};

}  // namespace relmap::workflow
