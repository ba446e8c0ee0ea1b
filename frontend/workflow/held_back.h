// The first keyframes of a recording, till it is known that it can be tracked.
#pragma once

#include <cstddef>
#include <vector>

#include "frontend/console.h"
#include "frontend/workflow/delivery.h"
#include "proto/base/status.h"
#include "proto/keyframe/keyframe.h"

namespace relmap::workflow {

inline constexpr std::size_t kMaxHeldBack = 256;  // keyframes

// A session begins with its first keyframe, and would stay in the map: of a recording of which no pair follows from
// another none is sent. Not thread-safe.
class HeldBack {
 public:
  // Both must outlive it; `summary` counts the pairs that are tracked.
  HeldBack(Delivery& delivery, const frontend::RunSummary& summary) : delivery_(delivery), summary_(summary) {}

  // On to the delivery, in order, once two pairs hang together. untracked()'s reasons: none does, and kMaxHeldBack
  // wait.
  Status push(Keyframe keyframe);
  // All that wait: of a single pair there is nothing to hold it back for.
  Status release();

 private:
  Delivery& delivery_;
  const frontend::RunSummary& summary_;
  std::vector<Keyframe> waiting_;
};

}  // namespace relmap::workflow
