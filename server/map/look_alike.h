// Tells apart two floors that look alike, between which a lift took the robot unnoticed. Both odometry and geometry
// then agree with the wrong floor; what shows the mistake are small differences all along the way, which are found by
// comparing the pictures with what was seen there before (server/place/changes.h). If the robot drove, and saw, all the
// way in between, such a difference is a change of the place. If it stood still, it may have been carried
// (docs/method.md, 7).
#pragma once

#include <cstdint>
#include <vector>

#include "storage/graph/graph.h"

namespace relmap::map {

// All closures that say that one stretch of a session's motion is the same place as another.
struct SameStretch {
  // Ascending: closures that are accepted, lone candidates or refused as look-alikes, except those that contradict the
  // odometry.
  std::vector<EdgeId> closures;
  // Summed over the closures: parts of pictures that were compared with what was seen there before, and how many of
  // these show something else.
  std::uint32_t compared = 0, changed = 0;
  bool decided = false;  // an operator put one of them into force: it is the same place

  bool is_compared() const;  // enough was compared to tell
  // Whether the stretch is another place that looks alike, or the same place. Between the two bounds neither holds, and
  // the earlier verdict stays.
  bool is_another() const;
  bool is_the_same() const;
  double change() const { return compared == 0 ? 0 : static_cast<double>(changed) / compared; }
};

struct LookAlikes {
  SameStretch place;  // the closures between the stretches of query and match; empty: it cannot be another place
  // Other stretches that closures in force say are the same place as the query's, although they are known to be another
  // place than the match's. Only one of all these can be right.
  std::vector<SameStretch> instead;
};

// Whether a stretch is `one` rather than `other`, of two places that are known to differ: `one` was put into force by
// an operator, or has changed less, or was compared where `other` was not.
bool is_rather(const SameStretch& one, const SameStretch& other);

// Collects the closures between the stretches of motion that contain the query and the match of `closure`. A stretch
// ends where the robot stood still for kMinRideSeconds (stops.h), or 300 frames away. Empty if the robot did not
// stand still between the two, or if they are further apart than motion is tested (kMotionReach).
LookAlikes weigh_look_alikes(const storage::Graph& graph, const storage::Edge& closure);

}  // namespace relmap::map
