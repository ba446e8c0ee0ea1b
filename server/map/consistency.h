// Pairwise consistency of loop closures (docs/method.md, 7): two closures of neighbouring frames agree if going round
// query -> match -> match' -> query' -> query comes back to where it began, within the covariance of the way. And one
// closure with the robot's own motion: going query -> match -> query does.
#pragma once

#include <vector>

#include "storage/graph.h"

namespace relmap {

inline constexpr std::uint32_t kConsistencyReach = 100;  // odometry edges between the two queries, and the two matches
inline constexpr std::size_t kMostTested = 24;           // closures, of the nearest queries
inline constexpr double kMoved = 0.1;                    // metres or radians
inline constexpr std::uint32_t kMotionReach = 1000;      // keyframes between a closure's ends

struct Neighbourhood {
  std::vector<EdgeId> agreeing;     // ascending
  std::vector<EdgeId> conflicting;  // accepted closures that were tested and do not agree
  std::vector<EdgeId> taken_out;    // closures that agree, and that an operator has removed
};

// Tests `closure` (an edge of kind loop, whether stored or not) against the closures of nearby query frames that the
// robot's motion does not contradict. Chains through unsensed motion are not
// tested; nor are queries between which the robot moved less than kMoved: one picture, twice, is one witness.
Neighbourhood test_consistency(const Graph& graph, const Edge& closure);

// Whether the odometry between the ends of `closure` says that it is wrong; no where there is none, or too much.
bool contradicts_motion(const Graph& graph, const Edge& closure);

// The largest set that holds `closure` and in which all agree pairwise; of equally large ones the first by edge id.
// `agreeing` are those that agree with it; whether two of these agree is read from their Edge::consistent_with.
std::vector<EdgeId> largest_consistent_set(const Graph& graph, EdgeId closure, const std::vector<EdgeId>& agreeing);

}  // namespace relmap
