// Adds the keyframes of a points world to a map over the memory engine, one by one, as the worker would; for tests and
// benchmarks. Places are not recognised: revisits are proposed as closures from the known world.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "server/map/map_builder.h"
#include "storage/map/map.h"
#include "tools/sim/measures.h"
#include "tools/sim/points_world.h"

namespace relmap::testing {

// The cost of a keyframe.
struct DriveStep {
  double relax_seconds = 0;  // for its relaxations, including that of a closure
  double apply_seconds = 0;  // for everything: frame, closure, support, relaxations
  bool closure = false;      // whether a closure came into force
  bool loop_edge = false;    // whether the closure became an edge of the graph
  std::uint32_t active_frames = 0;
  std::uint32_t solves = 0, iterations = 0, failures = 0;
  std::uint64_t work = 0;  // linearised observations
};

// The closure that a place recogniser would propose between the frames i and `match` of the world, which are `query`
// and `match_frame` in the map, the newer first, with one observation for each common landmark of the world. nullopt if
// they have too few points in common.
std::optional<storage::ClosureProposalRecord> simulated_closure(const storage::Map& map, const sim::PointsWorld& world,
                                                                std::uint32_t i, FrameId query, std::uint32_t match,
                                                                FrameId match_frame);

struct DriveClosures {
  bool proposed = true;
  std::uint32_t loop_edge_spacing = map::kLoopEdgeSpacing;
};

class SimulatedDrive {
 public:
  SimulatedDrive(sim::PointsWorldOptions world, rba::RbaOptions rba, DriveClosures closures = {});
  // Drives into `map`, which must be empty.
  SimulatedDrive(sim::PointsWorldOptions world, rba::RbaOptions rba, DriveClosures closures,
                 std::unique_ptr<storage::Map> map);

  // Applies the keyframes up to `end` (all, by default).
  void drive(std::uint32_t end = ~0U);
  // Idle work until nothing is pending, or `budget` is used up.
  rba::RbaSummary relax_idle(std::uint64_t budget);
  // The full solution: everything active, to convergence.
  rba::RbaSummary relax_fully();

  storage::Map& map() { return *map_; }
  const sim::PointsWorld& world() const { return world_; }
  const std::vector<DriveStep>& steps() const { return steps_; }
  std::uint32_t driven() const { return static_cast<std::uint32_t>(steps_.size()); }
  FrameId frame(std::uint32_t i) const { return {kSession, i}; }

  std::vector<SE3> truth() const;
  sim::RegistrationError registration_error(std::size_t stride = 1) const;
  sim::RegistrationError odometry_registration_error(std::size_t stride = 1) const;
  sim::RevisitError revisit_error() const;

 private:
  static constexpr SessionNumber kSession = 1;
  void apply(const storage::JournalRecord& record);  // as part of the last step
  // Proposes a closure of frame i with an earlier lap (a different one for each stretch): with the oldest view of the
  // place that has enough points in common.
  void propose_closure(std::uint32_t i);

  sim::PointsWorld world_;
  DriveClosures closures_;
  std::unique_ptr<storage::Map> map_;
  std::unique_ptr<map::MapBuilder> builder_;
  rba::RbaOptions rba_;
  std::uint64_t sequence_ = 0;
  std::vector<DriveStep> steps_;
};

}  // namespace relmap::testing
