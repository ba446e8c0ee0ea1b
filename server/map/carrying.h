// Decides whether a robot was carried. Closures with a session's own past that agree with each other but not with its
// odometry mean either that two places look alike, or that the robot was carried in between, by a lift, a train or a
// Ferris wheel (Sibley et al., 1 and 4.7). The evidence for both is weighed here (docs/method.md, 7).
#pragma once

#include <cstdint>
#include <set>
#include <vector>

#include "storage/graph/graph.h"

namespace relmap::map {

// The evidence of a set of closures that contradict the odometry.
struct CarryingEvidence {
  std::uint32_t views = 0;      // query frames of the closures
  double metres = 0;            // driven from the first view to the last; at most kMaxBetween between two views
  double stood_s = 0;           // longest time that the robot stood still where it may have been carried
  storage::FrameRange stretch;  // where that was; session 0: nowhere
  std::uint32_t opposed = 0;    // accepted closures of these queries that agree with the odometry; 2 outweigh all else
  // Means over the closures for which they are known (Uniqueness); negative: known for none.
  double rival = -1;    // inliers at the best place elsewhere, over those here
  double differs = -1;  // share of what both views should show that differs

  // Log-odds, in nats, of having been carried against two places that look alike; -infinity if there is no sign of a
  // ride.
  double weight() const;
  bool speaks_for_carrying() const { return weight() >= 0; }
};

// Weighs two or more closures of queries of one session that all say something about its motion (own_motion()).
// `closures` is ascending.
CarryingEvidence weigh_carrying(const storage::Graph& graph, const std::vector<EdgeId>& closures);

// Where the robot was carried, given that these closures are right. `closures` is as for weigh_carrying(), but one is
// enough. Steps that are covered by a closure in force which agrees with the odometry are excluded; closures in `gone`
// do not count for this. Of the remaining steps the answer is the stretch where the robot stood still for longest, or,
// if it never stood, the newest step, since a robot that comes back to a known place is recognised soon. Session 0 if
// no step remains.
storage::FrameRange where_carried(const storage::Graph& graph, const std::vector<EdgeId>& closures,
                                  const std::set<EdgeId>& gone);

}  // namespace relmap::map
