// Evaluates a drive with rides: whether the loop after the ride was closed, whether false loops were closed, and the
// error of the map.
#pragma once

#include <cstdint>
#include <map>

#include "proto/base/reason.h"
#include "storage/graph/graph.h"
#include "tools/bench/ride_drive.h"

namespace relmap::bench {

// A closure is right if it is within 0.5 m and 10 degrees of the truth (docs/method.md, 5).
struct RideFigures {
  // The front-end's.
  std::uint32_t keyframes = 0, pairs = 0, lost = 0;
  std::uint32_t unseen_steps = 0;      // keyframes, except the first, whose step vision did not measure
  double carried_m = 0;                // true distance that the robot was carried
  double sensed_m = 0;                 // distance according to the odometry meanwhile
  double standing_s = 0;               // of the keyframes from boarding to alighting
  double longest_standing_s = 0;       // maximum at one of these keyframes
  double longest_standing_else_s = 0;  // maximum at one of all other keyframes
  double odometry_error_m = 0;         // of the last keyframe relative to the one before the first ride
  // The map's.
  std::uint32_t right = 0, wrong = 0;  // closures in force
  std::uint32_t wrong_meanwhile = 0;   // closures that were in force and no longer are
  std::uint32_t closed = 0;            // right closures from after the last ride to before the first
  std::uint32_t of_cabin = 0;          // closures in force that match the carrier, which has moved in between
  std::map<Reason, std::uint32_t> right_refused, wrong_refused;  // closures not in force, by reason
  std::uint32_t contradicting = 0;  // closures, in force or not, 0.5 m or 10 degrees off the odometry
  std::uint32_t contradicting_right = 0;
  double contradicting_right_m = 0;  // driven between the first and the last of them
  std::uint32_t carried_edges = 0;   // odometry edges along which the map says that the robot was carried
  // Mean error of position over a metre of driving, mm: of the map, a pose graph, a robust pose graph.
  double local_error_mm = 0, local_error_pose_graph_mm = 0, local_error_pose_graph_robust_mm = 0;
};

// `graph` must have the single session that was made of the drive.
RideFigures evaluate_ride(const storage::Graph& graph, const RideDrive& drive);
// Mean error of position over a metre of driving as the map has it, mm.
double local_error_mm(const storage::Graph& graph, const RideDrive& drive);

}  // namespace relmap::bench
