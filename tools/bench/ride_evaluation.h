// What became of a drive with rides: was the loop behind it closed, was anything closed that should not have been, and
// what is the map worth?
#pragma once

#include <cstdint>
#include <map>

#include "proto/base/reason.h"
#include "storage/graph/graph.h"
#include "tools/bench/ride_drive.h"

namespace relmap::bench {

// Right: within 0.5 m and 10 degrees of the truth (docs/method.md, 5).
struct RideFigures {
  // The front-end's.
  std::uint32_t keyframes = 0, pairs = 0, lost = 0;
  std::uint32_t unseen_steps = 0;      // keyframes whose step vision did not measure, but the first
  double carried_m = 0;                // in truth
  double sensed_m = 0;                 // the odometry's way meanwhile
  double standing_s = 0;               // of the keyframes from boarding to alighting
  double longest_standing_s = 0;       // of them, at one keyframe
  double longest_standing_else_s = 0;  // at one keyframe of all others
  double odometry_error_m = 0;         // of the last keyframe, seen from that before the first ride
  // The map's.
  std::uint32_t right = 0, wrong = 0;  // closures in force
  std::uint32_t wrong_meanwhile = 0;   // that were in force, and are not any more
  std::uint32_t closed = 0;            // of the right ones, those from behind the last ride to before the first
  std::uint32_t of_cabin = 0;          // in force, and true of what carries the robot, which has moved between
  std::map<Reason, std::uint32_t> right_refused, wrong_refused;  // closures that are not in force, by why
  std::uint32_t contradicting = 0;  // closures, in force or not, 0.5 m or 10 degrees off the odometry
  std::uint32_t contradicting_right = 0;
  double contradicting_right_m = 0;  // driven between the first and the last of them
  std::uint32_t carried_edges = 0;   // of the robot's own motion, along which the map says that it was carried
  // Mean error of position over a metre of driving, mm.
  double local_error_mm = 0, local_error_pose_graph_mm = 0, local_error_pose_graph_robust_mm = 0;
};

// `graph`: of the one session that was made of the drive.
RideFigures evaluate_ride(const storage::Graph& graph, const RideDrive& drive);
// Mean error of position over a metre of driving as the map has it, mm.
double local_error_mm(const storage::Graph& graph, const RideDrive& drive);

}  // namespace relmap::bench
