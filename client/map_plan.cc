#include "client/map_plan.h"

#include <algorithm>
#include <cmath>

namespace relmap::client {
namespace {

constexpr double kMinExtent = 2;  // metres; limits the scale of a plan with a single frame

template <typename Turned>
Box bounds(const std::vector<Vector3>& positions, const Turned& turned) {
  Box box{turned(positions[0]), turned(positions[0])};
  for (const Vector3& p : positions) {
    box.low = box.low.cwiseMin(turned(p));
    box.high = box.high.cwiseMax(turned(p));
  }
  return box;
}

}  // namespace

MapPlan::MapPlan(const std::vector<Vector3>& positions, double width, double max_height, bool turn) {
  const auto turned_now = [this](const Vector3& v) { return turned(v); };
  if (turn) {
    double lowest = 1e300, best = 0;
    for (int degrees = 0; degrees < 180; degrees += 2) {
      cos_ = std::cos(degrees * M_PI / 180);
      sin_ = std::sin(degrees * M_PI / 180);
      const double tall = bounds(positions, turned_now).size().y();
      if (tall < lowest * (1 - 1e-9)) {
        lowest = tall;
        best = degrees;
      }
    }
    cos_ = std::cos(best * M_PI / 180);
    sin_ = std::sin(best * M_PI / 180);
  }
  const Box box = bounds(positions, turned_now);
  const Vector2 extent = box.size().cwiseMax(kMinExtent);
  scale_ = std::min(width / extent.x(), max_height / extent.y());
  height_ = extent.y() * scale_;
  origin_ = (box.low + box.high) / 2 - Vector2(width, height_) / (2 * scale_);
}

Vector2 MapPlan::turned(const Vector3& v) const {
  return {cos_ * v.x() + sin_ * v.z(), sin_ * v.x() - cos_ * v.z()};  // the page's y points down
}

Vector2 MapPlan::at(const Vector3& position) const { return (turned(position) - origin_) * scale_; }

Vector2 MapPlan::heading(const SE3& pose) const {
  const Vector2 forward = turned(pose.R.col(2));
  return forward.norm() < 1e-6 ? Vector2::Zero() : Vector2(forward.normalized());
}

}  // namespace relmap::client
