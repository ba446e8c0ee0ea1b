// Was the robot carried? Closures of a session's own past that agree with each other and not with its odometry mean
// either that two places look alike, or that the robot was carried in between: by a lift, a train, a ferry wheel
// (Sibley et al., 1 and 4.7). Here what speaks for the one and the other is weighed (docs/method.md, 7).
#pragma once

#include <cstdint>
#include <set>
#include <vector>

#include "storage/graph/graph.h"

namespace relmap::map {

// What a set of closures that contradict the odometry has to show. A function of map and journal.
struct CarryingEvidence {
  std::uint32_t views = 0;      // query frames that agree on one gap
  double metres = 0;            // driven along them; what lies between two counts as kMaxBetween at most
  double stood_s = 0;           // the robot stood still, in one go, where it may have been carried
  storage::FrameRange stretch;  // and there; session 0: nowhere
  std::uint32_t opposed = 0;    // accepted closures of these queries that agree with the odometry; 2 outweigh all else
  // Means over those of the closures of which it is known (Uniqueness); negative: of none.
  double rival = -1;    // inliers at the best place elsewhere, over those here
  double differs = -1;  // share of what both views should show in which they show different things

  // In nats, what it says for being carried against looking alike; -infinity where there is no sign of a ride at all.
  double weight() const;
  bool speaks_for_carrying() const { return weight() >= 0; }
};

// `closures`: of one session's own past, ascending, two at least.
CarryingEvidence weigh_carrying(const storage::Graph& graph, const std::vector<EdgeId>& closures);

// Where the robot was carried if these closures (as above, one at least) are right, whatever speaks for it: along no
// step that a closure in force covers which agrees with the odometry, those that are `gone` left out; there where it
// stood for longest, or else along the newest step, for a robot that comes back to a known place is recognised soon.
// Session 0: along no step at all.
storage::FrameRange where_carried(const storage::Graph& graph, const std::vector<EdgeId>& closures,
                                  const std::set<EdgeId>& gone);

}  // namespace relmap::map
