// From camera poses in metres to places on the page.
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

// The view from above that fits positions into a width and a height.
class MapPlan {
 public:
  // `turn`: so that the plan becomes as low as it can. At least one position, all finite.
  MapPlan(const std::vector<Vector3>& positions, double width, double max_height, bool turn);

  double points_per_metre() const { return scale_; }
  double height() const { return height_; }  // that the plan needs
  // From the top left corner of the plan's area.
  Vector2 at(const Vector3& position) const;
  // Direction of travel on the page, a unit vector; zero for a camera that looks straight up or down.
  Vector2 heading(const SE3& pose) const;

 private:
  Vector2 turned(const Vector3& v) const;

  double cos_ = 1, sin_ = 0;
  double scale_ = 1, height_ = 0;
  Vector2 origin_ = Vector2::Zero();  // in turned metres, of the area's corner
};

}  // namespace relmap::client
