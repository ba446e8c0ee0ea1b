// Pairwise consistency of loop closures (docs/method.md, 7). Two closures of neighbouring frames agree if the loop
// query -> match -> match' -> query' -> query is the identity within its covariance. A closure agrees with the robot's
// own motion if the loop query -> match -> query along the odometry is, or with another session query -> match -> a
// frame before a stop -> query (way_around.h).
#pragma once

#include <cstdint>
#include <vector>

#include "server/map/own_motion.h"
#include "storage/graph/frame_range.h"
#include "storage/graph/graph.h"

namespace relmap::map {

inline constexpr std::size_t kMaxTested = 24;  // closures that one is tested against, of the nearest queries

// The rules and thresholds of consistency. Maps that are kept use the defaults; other values are for measuring what
// each rule is worth (`relmap-bench closures`, docs/decisions/closures.md).
struct ConsistencyRules {
  std::uint32_t reach = 100;    // odometry edges between the two queries, and between the two matches, at most
  double moved = 0.1;           // two witnesses are at least so many metres or radians apart
  double drift_share = 0.01;    // systematic error of odometry: standard deviation of position over the distance,
  double drift_radians = 3e-4;  // and of rotation, per metre
  // Standard deviations of errors that no covariance includes: calibration, rounding, and the distance between
  // keyframes and their pictures.
  double floor_metres = 0.01;
  double floor_radians = 0.002;
  bool motion = true;       // the odometry between its ends may refuse a closure
  bool coarse = true;       // two closures that agree with the same accepted one do not oppose each other
  bool rides = true;        // a set that contradicts the odometry may mean that the robot was carried
  bool alone = true;        // a closure beyond doubt needs no other
  bool look_alikes = true;  // a stretch behind a stop that differs all along from what was seen is another place
};

// The verdict of the robot's own motion on a closure that says something about it (own_motion()).
enum class MotionVerdict : std::uint8_t {
  kUntested,     // it says nothing about it, or there is motion that nothing sensed
  kAgrees,       // agrees with the odometry
  kAsMeasured,   // agrees only with the odometry corrected by what closures in force measured where the robot was
                 // carried
  kContradicts,  // agrees with neither
  kDenies,       // agrees with the odometry alone: it denies what closures in force say, that the robot was carried
};
struct MotionTest {
  MotionVerdict verdict = MotionVerdict::kUntested;
  std::vector<storage::FrameRange> carried;  // carried stretches between the closure's ends, the newest first
  std::vector<EdgeId> carriers;              // the closures that say so, ascending
  // How well the motion tells where the closure's ends lie, one standard deviation, metres; 0: it says nothing.
  double sigma = 0;
};
MotionTest test_motion(const storage::Graph& graph, const storage::Edge& closure, const ConsistencyRules& rules = {});

// Whether `closure` stands for the robot having been carried, by the verdict stored with it.
inline bool contradicts_odometry(const storage::Edge& closure) {
  return closure.reason == Reason::CONTRADICTS_MOTION || closure.carried.session != 0;
}

struct Neighbourhood {
  // Ascending:
  std::vector<EdgeId> agreeing;     // closures that agree and are not removed
  std::vector<EdgeId> conflicting;  // accepted closures that were tested and do not agree
  std::vector<EdgeId> taken_out;    // closures that agree and that an operator has removed with their set
};

// Tests `closure` (an edge of kind loop, stored or not) against the closures of nearby query frames. A closure that
// contradicts the odometry (contradicts_odometry()) can agree only with others that do; any other closure only with
// those that the odometry does not contradict, or that are in force although it does. Loops follow carried stretches as
// closures in force measured them, and are not tested if they lead through motion that nothing sensed. Queries between
// which the robot moved less than `moved` are skipped: two pictures from one spot are one witness.
Neighbourhood test_consistency(const storage::Graph& graph, const storage::Edge& closure,
                               const ConsistencyRules& rules = {});

// The largest set of pairwise agreeing closures that contains `closure`, ascending; of several, the first by edge id.
// `agreeing` are the closures that agree with `closure`; Edge::consistent_with tells which of these agree with each
// other. Only the last 16 of `agreeing` are considered.
std::vector<EdgeId> largest_consistent_set(const storage::Graph& graph, EdgeId closure,
                                           const std::vector<EdgeId>& agreeing);

}  // namespace relmap::map
