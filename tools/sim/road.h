// The road of a drive with rides: a closed plan, and its height.
#pragma once

#include <optional>

#include "proto/geometry/geometry.h"
#include "tools/sim/circuit.h"
#include "tools/sim/ground_plan.h"
#include "tools/sim/picture_world_options.h"

namespace relmap::sim {

inline constexpr double kStorey = 4;  // metres from floor to floor

// Metres along the road.
struct Slope {
  double from, to;
};
double lift_place(const PictureWorldOptions& options);      // where the robot stands in the lift
Slope escalator_place(const PictureWorldOptions& options);  // from where it boards to where it alights

// The circuit of a street, or the corridor of a building: a rounded rectangle, whose halves are the same after a turn
// by 180 degrees. `way` is in metres along the road, any real number.
class Road {
 public:
  Road(const PictureWorldOptions& options, const Circuit& circuit);  // the circuit must outlive it

  double length() const { return options_.circuit_length(); }
  double height(double way) const;
  Vector2 point(double way) const;  // (x, z)
  // The point `offset` metres to the right of the road, in the plan.
  Vector2 beside(double way, double offset) const;
  // Pose of the road on the ground: x right, y down, z ahead and level.
  SE3 T_world_road(double way) const;

 private:
  Vector2 direction(double way) const;

  const PictureWorldOptions options_;
  const Circuit& circuit_;
  std::optional<GroundPlan> corridor_;
};

}  // namespace relmap::sim
