// Adaptive relative bundle adjustment (docs/method.md, 2 to 4; Sibley et al., IJRR 2010, sections 3.1 to 3.5): what the
// map worker calls. The work of a call is bounded by counted units (linearised observations), never by time, so that a
// journal replays to the same map bit for bit.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "storage/map/map.h"

namespace relmap::rba {

struct RbaOptions {
  std::uint32_t window = 8;      // frames nearest to a new frame in the graph that it activates; 0: nothing is relaxed
  double delta_eps = 0.05;       // sigmas: change of a frame's mean error that activates it
  double idle_delta_eps = 0.01;  // likewise, in idle work
  std::uint64_t budget = 60000;  // linearised observations per update; the rest stays in MapState::pending
  int max_iterations = 6;        // of Levenberg-Marquardt, per solve
  double huber_px = 2.0;         // in units of sigma
};

struct RbaSummary {
  std::uint32_t solves = 0;
  std::uint32_t iterations = 0;
  std::uint32_t active_frames = 0;  // in all solves together, each counted once
  std::uint64_t work = 0;           // linearised observations
  std::uint32_t failures = 0;       // NUMERICAL: left as it was
  double cost_before = 0, cost_after = 0;
};

// Used by the one thread that edits the map. Keeps its memory from one call to the next: where the map is in memory,
// and no region larger than those before nor than ReducedSystem::kMaxDense edges, none is asked for.
class Relaxer {
 public:
  Relaxer(storage::Map& map, const RbaOptions& options);
  ~Relaxer();

  // Sessions of which no frame is activated and no landmark moves, from now on.
  void freeze(std::vector<SessionNumber> sessions);

  // Relaxes the map around `seeds` (a new frame; both ends of a new loop edge): window, solve, ripple, until nothing
  // explored has moved or the budget is used up. Updates edges (estimate, covariance), landmarks, mean errors and
  // state().pending. `unsettle`: settled landmarks and frames move as well, as where something false that helped to
  // settle them has been taken out.
  RbaSummary relax(std::span<const FrameId> seeds, bool unsettle = false);

  // Continues with state().pending at idle_delta_eps; work == 0 in the summary when nothing is left.
  RbaSummary relax_pending(std::uint64_t budget);

  // The full relative solution, everything active, to convergence: for comparisons. Covariances stay as they are.
  RbaSummary relax_fully();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace relmap::rba
