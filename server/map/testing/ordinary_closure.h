// The facts of a loop closure as most true ones are, for tests and pictures of suspicion.
#pragma once

#include "storage/graph/digest.h"

namespace relmap::map {

// Accepted with five others that agree, and as the robot's motion says, too. A test changes what it is about.
inline storage::ClosureDigest ordinary_closure() {
  storage::ClosureDigest closure;
  closure.state = storage::EdgeState::kAccepted;
  closure.reason = Reason::CONSISTENT;
  closure.verification = storage::Verification::kStereo;
  closure.inliers = 90;
  closure.spread = 0.3F;
  closure.probability = 0.97F;
  closure.agreeing = 5;
  closure.uniqueness = {.known = true, .runner_up = {2, 3}, .runner_up_inliers = 12, .runner_up_probability = 0};
  closure.uniqueness.differs = 0.1F;
  closure.tests = {0, storage::MotionSays::kAgrees, 0.5F};
  return closure;
}

}  // namespace relmap::map
