// The road of a drive with rides: a closed plan, and how high it lies.
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

// The street's circuit, or a building's corridor: a rounded rectangle of which one half is the other, turned by 180
// degrees. `way`: metres, any real number.
class Road {
 public:
  Road(const PictureWorldOptions& options, const Circuit& circuit);  // the circuit must outlive it

  double length() const { return options_.circuit_length(); }
  double height(double way) const;
  Vector2 point(double way) const;  // (x, z)
  // `offset` metres to the right of it, in the plan.
  Vector2 beside(double way, double offset) const;
  // On the ground: x to the right, y down, z ahead and level.
  SE3 T_world_road(double way) const;

 private:
  Vector2 direction(double way) const;

  const PictureWorldOptions options_;
  const Circuit& circuit_;
  std::optional<GroundPlan> corridor_;
};

}  // namespace relmap::sim
