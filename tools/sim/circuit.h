// A closed smooth road in the plane, and how it is driven.
#pragma once

#include <cstdint>
#include <vector>

#include "proto/geometry/geometry.h"

namespace relmap::sim {

// How far a circuit departs from a circle.
struct CircuitShape {
  double amplitude[3][2] = {
      {0.14, 0.24}, {0.04, 0.09}, {0.01, 0.03}};  // minimum and maximum of each harmonic, as a share of the radius
  int samples = 8192;                             // entries of the table of arc lengths, interpolated linearly
};

// A curve r(angle) with a few harmonics, scaled to its length. Plan coordinates are (x, z) of a world whose y points
// down. All functions take the arc length s in metres, any real number; they repeat after length().
class Circuit {
 public:
  Circuit(std::uint64_t seed, double length_m, const CircuitShape& shape = {});

  double length() const { return length_; }
  Vector2 point(double s) const;
  Vector2 direction(double s) const;  // unit tangent in the sense of driving
  // The point at `offset` metres to the right of the driver.
  Vector2 beside(double s, double offset) const;
  double min_radius() const { return min_radius_; }  // of curvature, metres
  int inner_side() const { return inner_side_; }     // +1: the inside of the circuit lies to the right

 private:
  Vector2 at_angle(double angle, Vector2* derivative) const;
  double angle(double s) const;

  double length_;
  double step_;  // between two samples, radians
  double radius_ = 1;
  double amplitude_[3], phase_[3];
  int inner_side_ = 1;
  double min_radius_ = 0;
  std::vector<double> arc_;  // arc length at equally spaced angles
};

}  // namespace relmap::sim
