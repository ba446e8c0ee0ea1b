#include "tools/sim/road.h"

#include <cmath>

#include "tools/sim/itinerary.h"

namespace relmap::sim {
namespace {

constexpr double kEscalatorRise = 2.5;  // metres
constexpr double kEscalator = 9;        // metres in the plan
constexpr double kLanding = 1;          // at either end of an escalator: metres in which its slope changes
constexpr double kRampEnd = 2;          // likewise of a ramp

}  // namespace

double lift_place(const PictureWorldOptions& o) { return o.ride_way / 2 + 6; }

Slope escalator_place(const PictureWorldOptions& o) {
  const double from = o.ride_way / 2 + 2;
  return {from, from + kEscalator};
}

Road::Road(const PictureWorldOptions& options, const Circuit& circuit) : options_(options), circuit_(circuit) {
  if (options.scene == SceneKind::kBuilding) corridor_.emplace(PlanShape::kRoundedRectangle, options.ride_way);
}

double Road::height(double way) const {
  const double round = length(), laps = std::floor(way / round), s = way - laps * round;
  switch (options_.ride) {
    case RideKind::kLiftRamp:
      return kStorey * (laps + eased(s - 12, round - 18, kRampEnd));
    case RideKind::kEscalator: {
      const Slope escalator = escalator_place(options_);
      return kEscalatorRise * (eased(s - escalator.from - 0.5, kEscalator - 1, kLanding) -
                               eased(s - escalator.to - 4, round - escalator.to - 5, kRampEnd));
    }
    default:
      return 0;
  }
}

Vector2 Road::point(double way) const {
  if (!corridor_) return circuit_.point(way);
  const PlanePose at = corridor_->at(way);
  return {at.x, at.z};
}

Vector2 Road::direction(double way) const {
  if (!corridor_) return circuit_.direction(way);
  const double yaw = corridor_->at(way).yaw;
  return {std::sin(yaw), std::cos(yaw)};
}

Vector2 Road::beside(double way, double offset) const {
  const Vector2 d = direction(way);
  return point(way) + offset * Vector2(d.y(), -d.x());
}

SE3 Road::T_world_road(double way) const {
  const Vector2 at = point(way), ahead = direction(way);
  SE3 out;
  out.R.col(0) = Vector3(ahead.y(), 0, -ahead.x());
  out.R.col(1) = Vector3(0, 1, 0);
  out.R.col(2) = Vector3(ahead.x(), 0, ahead.y());
  out.t = Vector3(at.x(), -height(way), at.y());
  return out;
}

}  // namespace relmap::sim
