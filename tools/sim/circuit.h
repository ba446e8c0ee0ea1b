// A closed smooth road in the plane, and how it is driven.
#pragma once

#include <cstdint>
#include <vector>

#include "proto/geometry.h"

namespace relmap::sim {

// A curve r(angle) with a few harmonics, scaled to its length. Plan coordinates are (x, z) of a world whose y points
// down. All functions take the arc length s in metres, any real number; they repeat after length().
class Circuit {
 public:
  Circuit(std::uint64_t seed, double length_m);

  double length() const { return length_; }
  Vector2 point(double s) const;
  Vector2 direction(double s) const;  // unit tangent in the sense of driving
  // The point at `offset` metres to the right of the driver.
  Vector2 beside(double s, double offset) const;
  double smallest_radius() const { return smallest_radius_; }  // of curvature, metres
  int inner_side() const { return inner_side_; }               // +1: the inside of the circuit lies to the right

 private:
  Vector2 at_angle(double angle, Vector2* derivative) const;
  double angle(double s) const;

  double length_;
  double radius_ = 1;
  double amplitude_[3], phase_[3];
  int inner_side_ = 1;
  double smallest_radius_ = 0;
  std::vector<double> arc_;  // arc length at equally spaced angles
};

}  // namespace relmap::sim
