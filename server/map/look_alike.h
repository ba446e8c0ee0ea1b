// Two floors that look alike, and a lift between them that the robot did not notice: its odometry agrees with the wrong
// one, and so does geometry. What tells is that something there is different, all the way along: the pictures are asked
// whether they show what was seen there (server/place/changes.h). Where the robot drove all the way in between, and saw
// it, such a difference is a place that has changed; where it stood still, it may have been carried (docs/method.md,
// 7).
#pragma once

#include <cstdint>
#include <vector>

#include "storage/graph/graph.h"

namespace relmap::map {

// Closures that take one stretch of a session's motion for another one. A function of the map.
struct SameStretch {
  // Ascending: in force, awaiting confirmation, or refused as these are; but for those that contradict the odometry.
  std::vector<EdgeId> closures;
  // Summed over them: parts of pictures that were compared with what was seen there, and of those the ones that show
  // something else.
  std::uint32_t compared = 0, changed = 0;
  bool decided = false;  // an operator put one of them into force: it is the same

  bool is_compared() const;  // enough to tell
  // Whether it is another place that looks alike. Between the two bounds it is what it was taken for before.
  bool is_another() const;
  bool is_the_same() const;
  double change() const { return compared == 0 ? 0 : static_cast<double>(changed) / compared; }
};

struct LookAlikes {
  SameStretch place;  // what the closure says with others; no closures where it cannot be another place
  // What closures in force take the stretch of the query for, and which is known to be another place than that of the
  // match. Only one of them can be right.
  std::vector<SameStretch> instead;
};

// Of two places that are told apart a stretch can be one at most. Whether it is `one` and not `other`: that has changed
// less, or was compared where the other was not; or an operator says so.
bool is_rather(const SameStretch& one, const SameStretch& other);

// Of all closures from the stretch of its session's motion in which the query of `closure` lies to that of its match.
// A stretch ends where the robot stood still for kMinRideSeconds (stops.h), or some hundred frames away. Nothing where
// the robot did not stand between the two, or they lie further apart than motion is tested (kMotionReach).
LookAlikes weigh_look_alikes(const storage::Graph& graph, const storage::Edge& closure);

}  // namespace relmap::map
