// Measures that are fair to a relative map (docs/method.md, 5), against exact truth.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "proto/geometry/geometry.h"

namespace relmap::sim {

// Frames stand for their index 0 .. n - 1 in `truth` (T_world_frame, any world).

// T_root_frame of every frame, unrolled breadth-first from the root; nullopt: not connected.
using Unroll = std::function<std::vector<std::optional<SE3>>(std::size_t root)>;

struct RegistrationError {
  double mean_m = 0;             // over all roots, of the mean distance of each frame to its truth
  std::size_t roots = 0;         // that were used
  std::size_t disconnected = 0;  // pairs left out
};
// Each `stride`-th frame in turn is put on its truth, and the rest unrolled from it (Sibley et al. 2010, 4.2).
RegistrationError registration_error(const std::vector<SE3>& truth, const Unroll& unroll, std::size_t stride = 1);

// A frame that comes back to where one was before, and the earlier frame nearest to it.
struct Revisit {
  std::size_t frame = 0, earlier = 0;
};
// Earlier by more than 10 s and 20 frames, within 1 m and 30 degrees in truth. `time_us` ascending.
std::vector<Revisit> find_revisits(const std::vector<SE3>& truth, const std::vector<std::int64_t>& time_us);

struct RevisitError {
  double mean_m = 0, max_m = 0;
  double mean_rad = 0;
  std::size_t revisits = 0;      // measured
  std::size_t disconnected = 0;  // for which there was no relative pose
};
// Of T_earlier_frame, as the map has it, against truth: what a loop closure must mend.
using RelativePose = std::function<std::optional<SE3>(std::size_t a, std::size_t b)>;  // T_ab
RevisitError revisit_error(const std::vector<SE3>& truth, const std::vector<Revisit>& revisits,
                           const RelativePose& relative);

}  // namespace relmap::sim
