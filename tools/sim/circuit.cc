#include "tools/sim/circuit.h"

#include <algorithm>
#include <cmath>

#include "tools/sim/random.h"

namespace relmap::sim {

Circuit::Circuit(std::uint64_t seed, double length_m, const CircuitShape& shape)
    : length_(length_m), step_(2 * M_PI / shape.samples) {
  Random random(seed, 1);
  inner_side_ = random.chance(0.5) ? 1 : -1;
  for (int k = 0; k < 3; ++k) {
    amplitude_[k] = random.uniform(shape.amplitude[k][0], shape.amplitude[k][1]);
    phase_[k] = random.uniform(0, 2 * M_PI);
  }
  arc_.resize(shape.samples + 1);
  double tightest = 1e30;  // of the curve with radius 1
  for (int i = 0; i < shape.samples; ++i) {
    Vector2 before, after;
    const Vector2 a = at_angle(i * step_, &before), b = at_angle((i + 1) * step_, &after);
    arc_[i + 1] = arc_[i] + (b - a).norm();
    const double turn = std::abs(std::atan2(before.x() * after.y() - before.y() * after.x(), before.dot(after)));
    tightest = std::min(tightest, (b - a).norm() / std::max(turn, 1e-12));
  }
  radius_ = length_ / arc_.back();
  for (double& s : arc_) s *= radius_;
  arc_.back() = length_;
  min_radius_ = tightest * radius_;
}

Vector2 Circuit::at_angle(double angle, Vector2* derivative) const {
  double r = 1, dr = 0;
  for (int k = 0; k < 3; ++k) {
    const int n = k + 2;
    r += amplitude_[k] * std::cos(n * angle + phase_[k]);
    dr -= amplitude_[k] * n * std::sin(n * angle + phase_[k]);
  }
  const double c = std::cos(angle), s = std::sin(angle);
  const double mirror = -inner_side_;  // angles grow to the left: the inside is then on the left
  if (derivative) *derivative = Vector2(dr * c - r * s, mirror * (dr * s + r * c)) * radius_;
  return Vector2(r * c, mirror * r * s) * radius_;
}

double Circuit::angle(double s) const {
  const double wrapped = s - length_ * std::floor(s / length_);
  const auto after = std::upper_bound(arc_.begin() + 1, arc_.end() - 1, wrapped);
  const auto i = static_cast<double>(after - arc_.begin()) - 1;
  return (i + (wrapped - *(after - 1)) / (*after - *(after - 1))) * step_;
}

Vector2 Circuit::point(double s) const { return at_angle(angle(s), nullptr); }

Vector2 Circuit::direction(double s) const {
  Vector2 derivative;
  at_angle(angle(s), &derivative);
  return derivative.normalized();
}

Vector2 Circuit::beside(double s, double offset) const {
  const Vector2 d = direction(s);
  return point(s) + offset * Vector2(d.y(), -d.x());
}

}  // namespace relmap::sim
