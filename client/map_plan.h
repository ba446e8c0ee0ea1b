// Maps camera poses in metres to positions on the page.
#pragma once

#include <vector>

#include "proto/geometry/geometry.h"

namespace relmap::client {

struct Box {
  Vector2 low, high;
  Vector2 size() const { return high - low; }
  bool overlaps(const Box& other) const {
    return low.x() < other.high.x() && other.low.x() < high.x() && low.y() < other.high.y() && other.low.y() < high.y();
  }
  bool contains(const Vector2& p) const {
    return p.x() >= low.x() && p.x() <= high.x() && p.y() >= low.y() && p.y() <= high.y();
  }
};

// A plan seen from above, scaled so that all positions fit into a width and a height.
class MapPlan {
 public:
  // There must be at least one position, and all must be finite. `turn`: rotates the plan so that it is as low as
  // possible.
  MapPlan(const std::vector<Vector3>& positions, double width, double max_height, bool turn);

  double points_per_metre() const { return scale_; }
  double height() const { return height_; }  // points
  // The position on the page, in points from the top left corner of the plan.
  Vector2 at(const Vector3& position) const;
  // The direction in which the camera looks, as a unit vector on the page; zero if it looks straight up or down.
  Vector2 heading(const SE3& pose) const;

 private:
  Vector2 turned(const Vector3& v) const;

  double cos_ = 1, sin_ = 0;
  double scale_ = 1, height_ = 0;
  Vector2 origin_ = Vector2::Zero();  // the plan's corner, in metres after turning
};

}  // namespace relmap::client
