// Measures that are fair to a relative map (docs/method.md, 5), against exact truth.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "proto/geometry/geometry.h"

namespace relmap::sim {

// Frames are indices 0 .. n - 1 into `truth` (T_world_frame, in any world).

// T_root_frame of every frame, unrolled breadth-first from the root; nullopt: not connected to it.
using Unroll = std::function<std::vector<std::optional<SE3>>(std::size_t root)>;

struct RegistrationError {
  double mean_m = 0;             // mean over all roots of the mean distance of the frames to their truth
  std::size_t roots = 0;         // number of roots used
  std::size_t disconnected = 0;  // pairs of root and frame left out, since they are not connected
};
// Uses each `stride`-th frame in turn as root: its pose is set to the truth, and the others are unrolled from it
// (Sibley et al. 2010, 4.2).
RegistrationError registration_error(const std::vector<SE3>& truth, const Unroll& unroll, std::size_t stride = 1);

// A frame that returns to the place of an earlier one, and the nearest such earlier frame.
struct Revisit {
  std::size_t frame = 0, earlier = 0;
};
// Revisits are within 1 m and 30 degrees of a frame that is more than 10 s and 20 frames older. `time_us` ascending.
std::vector<Revisit> find_revisits(const std::vector<SE3>& truth, const std::vector<std::int64_t>& time_us);

struct RevisitError {
  double mean_m = 0, max_m = 0;
  double mean_rad = 0;
  std::size_t revisits = 0;      // measured
  std::size_t disconnected = 0;  // for which there was no relative pose
};
// The error of the map's T_earlier_frame against the truth, which loop closures must reduce.
using RelativePose = std::function<std::optional<SE3>(std::size_t a, std::size_t b)>;  // T_ab
RevisitError revisit_error(const std::vector<SE3>& truth, const std::vector<Revisit>& revisits,
                           const RelativePose& relative);

}  // namespace relmap::sim
