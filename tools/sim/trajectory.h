// Pose and motion of the camera of a picture world, at any time.
#pragma once

#include <optional>

#include "proto/geometry/geometry.h"
#include "tools/sim/circuit.h"
#include "tools/sim/faults.h"
#include "tools/sim/itinerary.h"
#include "tools/sim/picture_world_options.h"
#include "tools/sim/road.h"
#include "tools/sim/wander.h"

namespace relmap::sim {

struct Motion {
  SE3 T_world_left;
  Vector3 velocity;              // of the left camera, in world axes, m/s
  Vector3 acceleration;          // the same, m/s^2
  Vector3 angular_velocity;      // in the left camera's axes, rad/s
  Vector3 angular_acceleration;  // the same, rad/s^2
};

// Times are in frames since the first one, any real number.
class Trajectory {
 public:
  // All arguments must outlive the trajectory.
  Trajectory(const PictureWorldOptions& options, const Circuit& circuit, const FaultSchedule& faults);

  double distance(double frame) const;  // driven along the circuit, metres
  SE3 pose(double frame) const;         // T_world_left
  Motion motion(double frame) const;
  // The itinerary of a drive with rides; null if it has none.
  const Itinerary* itinerary() const { return itinerary_ ? &*itinerary_ : nullptr; }
  const Road& road() const { return road_; }

 private:
  SE3 straight(double frame) const;  // the pose of a head that is not turned
  SE3 on_road(const Itinerary::State& state) const;
  Vector3 head() const { return {options_.camera.baseline / 2, 0, 0}; }  // its axis, from the left camera

  const PictureWorldOptions& options_;
  const Circuit& circuit_;
  const FaultSchedule& faults_;
  const Road road_;
  std::optional<Itinerary> itinerary_;
  Wander lateral_, heading_, pitch_, roll_, bounce_, speed_;
};

}  // namespace relmap::sim
