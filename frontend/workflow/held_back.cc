#include "frontend/workflow/held_back.h"

#include <utility>

#include "frontend/workflow/pair_counts.h"

namespace relmap::workflow {

Status HeldBack::push(Keyframe keyframe) {
  if (summary_.tracked > 1) {
    if (Status status = release(); !status.ok()) return status;
    return delivery_.push(keyframe);
  }
  waiting_.push_back(std::move(keyframe));
  return waiting_.size() < kMaxHeldBack ? Status() : untracked(summary_, "none of the first ");
}

Status HeldBack::release() {
  for (const Keyframe& keyframe : std::exchange(waiting_, {}))
    if (Status status = delivery_.push(keyframe); !status.ok()) return status;
  return {};
}

}  // namespace relmap::workflow
