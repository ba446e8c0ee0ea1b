// Judges the town's map, in the folder of a stopped daemon, by the truth.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tools/bench/vast/vast_town.h"

namespace relmap::bench {

struct VastVerdict {
  std::uint64_t keyframes = 0, lost = 0, doubled = 0;  // doubled: one payload under two numbers
  // In force. Wrong: off by more than 0.5 m or 10 degrees, and by more than its covariance tells. Vague: off by so
  // much, but its covariance tells.
  std::uint64_t closures_right = 0, closures_vague = 0, closures_wrong = 0;
  std::vector<std::string> wrong;  // the first of the wrong ones, in words
  // A frame returns to a place if an earlier one, of another robot or long before, stood within 2 m and 15 degrees. It
  // is bound there if it has at least 20 observations of landmarks that were seen then.
  std::uint64_t revisits = 0, revisits_bound = 0;
  // Rides in trains; after how many of them the robot came where somebody had been before; and for how many of these
  // the map knows over which steps the robot was carried.
  std::uint64_t rides = 0, rides_returned = 0, rides_closed = 0;
  std::vector<std::string> unnoticed;  // the rides that are returned from and not closed, in words
  // Closures in force that say that the robot was carried where no train ran.
  std::uint64_t carried_wrongly = 0;
  double metres = 0, street_metres = 0;
  std::uint64_t bytes_on_disk = 0;
  std::uint64_t findings = 0;  // of `relmap-admin verify`
  // Of each step of the robots' motion, but for trains: how far the map has it off.
  std::vector<double> step_error_m;
  std::vector<double> own_step_error_m;  // and the robot's own odometry
  // Between frames at revisits and the earlier frame there, metres: by the robot's odometry alone, where one robot saw
  // both, and through the map. Of a sample.
  std::vector<double> odometry_error_m, map_error_m;
  std::uint64_t disconnected = 0;  // of the sample: no way through the map
};

VastVerdict judge_town(const VastTown& town, const VastOptions& options);

}  // namespace relmap::bench
