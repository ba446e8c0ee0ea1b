// Places the texts of a map so that they hide neither the map nor each other.
#pragma once

#include <vector>

#include "client/map_plan.h"
#include "proto/geometry/geometry.h"

namespace relmap::client {

class LabelPlacement {
 public:
  // Texts stay within `area`.
  explicit LabelPlacement(const Box& area) : area_(area) {}

  void avoid(const Vector2& point) { points_.push_back(point); }
  void avoid(const Box& box) { boxes_.push_back(box); }
  // Returns the box for a text of this size that belongs to `anchor`. Later texts avoid it.
  Box place(const Vector2& anchor, const Vector2& size);

 private:
  Box inside(const Box& box) const;
  double price(const Box& box, const Vector2& anchor) const;

  Box area_;
  std::vector<Vector2> points_;
  std::vector<Box> boxes_;
};

}  // namespace relmap::client
