// Adaptive relative bundle adjustment (docs/method.md, 2 to 4; Sibley et al., IJRR 2010, sections 3.1 to 3.5), as the
// map worker calls it. The work of a call is bounded by a count (linearised observations), never by time, so a journal
// replays to the same map bit for bit.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "storage/map/map.h"

namespace relmap::rba {

struct RbaOptions {
  std::uint32_t window = 8;      // a new frame activates this many frames nearest to it in the graph; 0: no relaxation
  double delta_eps = 0.05;       // in sigmas: a frame whose mean error changes by more is activated
  double idle_delta_eps = 0.01;  // the same in idle work
  std::uint64_t budget = 60000;  // linearised observations per update; the rest stays in MapState::pending
  int max_iterations = 6;        // of Levenberg-Marquardt, per solve
  double huber_px = 2.0;         // corner of Huber's loss in sigmas, which are pixels for a track at the lowest level
  // What the robot's own step counts, by information, where observations measure the edge: the same tracks made both.
  // 0: nothing, as in the paper.
  double own_step = 1.0 / 9;
};

struct RbaSummary {
  std::uint32_t solves = 0;
  std::uint32_t iterations = 0;
  std::uint32_t active_frames = 0;  // summed over the regions of this call
  std::uint64_t work = 0;           // linearised observations
  std::uint32_t failures = 0;       // solves that failed (NUMERICAL) and changed nothing
  double cost_before = 0, cost_after = 0;
};

// For the one thread that edits the map. Reuses its memory: a call allocates nothing if the map is in memory and the
// region is no larger than earlier ones, nor than ReducedSystem::kMaxDense edges.
class Relaxer {
 public:
  Relaxer(storage::Map& map, const RbaOptions& options);
  ~Relaxer();

  // Whether no frame of the session is activated and no landmark of it moves from now on; at first all do.
  void freeze(SessionNumber session, bool stands_still);

  // Relaxes the map around `seeds` (a new frame, or both ends of a new loop edge): activates the window, solves, and
  // lets the region ripple until no frame in reach has moved or a bound (budget, size of the region) is met. Updates
  // edges (estimate, covariance), landmarks, mean errors and state().pending. With `move_fixed`, fixed landmarks and
  // frames move as well: for use after a false closure that helped to fix them has been taken out.
  RbaSummary relax(std::span<const FrameId> seeds, bool move_fixed = false);

  // Relaxes frames of state().pending with idle_delta_eps until `budget` observations are linearised or none is
  // pending. The summary's work is 0 when there was nothing to do.
  RbaSummary relax_pending(std::uint64_t budget);

  // Computes the full relative solution to convergence, with all frames active, for comparisons. Covariances do not
  // change.
  RbaSummary relax_fully();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace relmap::rba
