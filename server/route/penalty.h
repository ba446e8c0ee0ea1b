// Makes edges dearer where other routes lead already (the penalty method: Bader, Dees, Geisberger, Sanders,
// "Alternative route graphs in road networks", TAPAS 2011).
#pragma once

#include "storage/graph/frame_set.h"

namespace relmap::route {

struct Penalty {
  const storage::FrameSet* frames = nullptr;  // an edge between two of these is dearer; null: none is
  double factor = 1;                          // 1 or more

  // By what the cost of an edge between these frames is multiplied.
  double operator()(FrameId from, FrameId to) const {
    return frames && frames->contains(from) && frames->contains(to) ? factor : 1.0;
  }
};

}  // namespace relmap::route
