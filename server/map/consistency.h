// Pairwise consistency of loop closures (docs/method.md, 7): two closures of neighbouring frames agree if going round
// query -> match -> match' -> query' -> query comes back to where it began, within the covariance of the way. And one
// closure with the robot's own motion: going query -> match -> query does.
#pragma once

#include <cstdint>
#include <vector>

#include "storage/graph/frame_range.h"
#include "storage/graph/graph.h"

namespace relmap::map {

inline constexpr std::size_t kMaxTested = 24;        // closures, of the nearest queries
inline constexpr std::uint32_t kMotionReach = 1000;  // keyframes between a closure's ends

// Which rules hold, and what they go by. Only the defaults are for maps that are kept; others show what each is worth
// (`relmap-bench closures`, docs/decisions/closures.md).
struct ConsistencyRules {
  std::uint32_t reach = 100;     // odometry edges between the two queries, and the two matches
  double moved = 0.1;            // metres or radians that two witnesses lie apart at least
  double drift_share = 0.01;     // what odometry has wrong all the way alike: standard deviation over its length,
  double drift_radians = 3e-4;   // and a metre
  double floor_metres = 0.01;    // what no covariance knows of: calibration, rounding, keyframes not quite where their
  double floor_radians = 0.002;  // pictures are
  bool motion = true;            // the odometry between its ends may refuse a closure
  bool coarse = true;            // two that an accepted one agrees with do not stand against each other
  bool rides = true;             // a set that contradicts the odometry may mean that the robot was carried
  bool alone = true;             // one that is beyond doubt needs no other
  bool look_alikes = true;       // what is not as it was, all along a stretch behind a stop, is another place
};

// What the robot's own motion says of a closure of its own past.
enum class MotionVerdict : std::uint8_t {
  kUntested,     // another session's, too far back, or through motion that nothing sensed
  kAgrees,       // with the odometry
  kAsMeasured,   // with the odometry and, where the robot was carried, what closures in force measured there
  kContradicts,  // neither
  kDenies,       // with the odometry alone, and not with what closures in force say: that it was carried
};
struct MotionTest {
  MotionVerdict verdict = MotionVerdict::kUntested;
  std::vector<storage::FrameRange> carried;  // stretches between its ends, the newest first
  std::vector<EdgeId> carriers;              // ascending: the closures that say so
};
MotionTest test_motion(const storage::Graph& graph, const storage::Edge& closure, const ConsistencyRules& rules = {});

// Whether `closure`, as its verdict was, stands for the robot having been carried.
inline bool contradicts_odometry(const storage::Edge& closure) {
  return closure.reason == Reason::CONTRADICTS_MOTION || closure.carried.session != 0;
}

struct Neighbourhood {
  std::vector<EdgeId> agreeing;     // ascending
  std::vector<EdgeId> conflicting;  // accepted closures that were tested and do not agree
  std::vector<EdgeId> taken_out;    // closures that agree, and that an operator has removed with all that agree
};

// Tests `closure` (an edge of kind loop, whether stored or not) against the closures of nearby query frames. One that
// contradicts the odometry agrees with others that do (contradicts_odometry()), any other with those that the odometry
// does not contradict. Chains through unsensed motion are not tested, and across a carried stretch they are as closures
// in force measured it; nor are queries between which the robot moved less than `moved`: one picture, twice, is one
// witness.
Neighbourhood test_consistency(const storage::Graph& graph, const storage::Edge& closure,
                               const ConsistencyRules& rules = {});

// The largest set that holds `closure` and in which all agree pairwise; of equally large ones the first by edge id.
// `agreeing` are those that agree with it; whether two of these agree is read from their Edge::consistent_with.
std::vector<EdgeId> largest_consistent_set(const storage::Graph& graph, EdgeId closure,
                                           const std::vector<EdgeId>& agreeing);

}  // namespace relmap::map
