#include "tools/sim/ground_plan.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

namespace relmap::sim {

namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kArcSteps = 20000;

double figure8_speed(double t) { return std::hypot(std::cos(2 * t), std::cos(t)); }

}  // namespace

GroundPlan::GroundPlan(PlanShape shape, double length) : shape_(shape), length_(length) {
  assert(length > 0);
  if (shape_ != PlanShape::kFigure8) return;
  // Simpson's rule over each step; good to 1e-14 of the whole.
  const double h = 2 * kPi / kArcSteps;
  arc_.resize(kArcSteps + 1);
  for (int k = 0; k < kArcSteps; ++k) {
    const double t = h * k;
    arc_[k + 1] = arc_[k] + h / 6 * (figure8_speed(t) + 4 * figure8_speed(t + h / 2) + figure8_speed(t + h));
  }
  scale_ = length_ / arc_.back();
}

PlanePose GroundPlan::at(double s) const {
  s = std::fmod(s, length_);
  if (s < 0) s += length_;
  switch (shape_) {
    case PlanShape::kFigure8:
      return figure8(s);
    case PlanShape::kCircle: {
      const double radius = length_ / (2 * kPi);
      const double angle = s / radius;  // starts north, turns right
      return {radius * (1 - std::cos(angle)), radius * std::sin(angle), angle};
    }
    case PlanShape::kRoundedRectangle:
      return rounded_rectangle(s);
  }
  return {};
}

PlanePose GroundPlan::figure8(double s) const {
  const double wanted = s / scale_;
  const auto upper = std::upper_bound(arc_.begin(), arc_.end(), wanted);
  const auto k = std::clamp<std::ptrdiff_t>(upper - arc_.begin() - 1, 0, kArcSteps - 1);
  const double t = 2 * kPi / kArcSteps * (static_cast<double>(k) + (wanted - arc_[k]) / (arc_[k + 1] - arc_[k]));
  return {scale_ * std::sin(2 * t) / 2, scale_ * std::sin(t), std::atan2(std::cos(2 * t), std::cos(t))};
}

PlanePose GroundPlan::rounded_rectangle(double s) const {
  // Width w, height 2 w, corner radius r = w / 5: length 6 w - 8 r + 2 pi r.
  const double w = length_ / (6 - 8.0 / 5 + 2 * kPi / 5);
  const double r = w / 5;
  PlanePose at;  // at the beginning of the western side, going north; then right at each corner
  for (int side = 0; side < 4; ++side) {
    const double straight = (side % 2 == 0 ? 2 * w : w) - 2 * r;
    const double forward = std::min(s, straight);
    at.x += forward * std::sin(at.yaw);
    at.z += forward * std::cos(at.yaw);
    s -= straight;
    if (s <= 0) return at;
    const double turn = std::min(s / r, kPi / 2);
    // The centre of the corner lies r to the right.
    const double cx = at.x + r * std::cos(at.yaw), cz = at.z - r * std::sin(at.yaw);
    at.yaw += turn;
    at.x = cx - r * std::cos(at.yaw);
    at.z = cz + r * std::sin(at.yaw);
    s -= r * kPi / 2;
    if (s <= 0) return at;
  }
  return at;
}

}  // namespace relmap::sim
