#include "client/label_placement.h"

#include <algorithm>
#include <cmath>

namespace relmap::client {

std::pair<std::int32_t, std::int32_t> LabelPlacement::square_of(const Vector2& point) {
  const auto square = [](double at) {
    return static_cast<std::int32_t>(std::floor(std::clamp(at, -1e6, 1e6) / kCell));
  };
  return {square(point.x()), square(point.y())};
}

Box LabelPlacement::place(const Vector2& anchor, const Vector2& size) {
  Box best{anchor, anchor + size};
  double cheapest = 1e300;
  for (const double distance : {20.0, 30.0, 44.0, 62.0, 85.0, 115.0})
    for (int k = 0; k < 24; ++k) {
      const double angle = 2 * M_PI * k / 24;
      const Vector2 direction(std::cos(angle), std::sin(angle));
      // `distance` is that from the anchor to the side of the box that faces it.
      const Vector2 middle =
          anchor + distance * direction + Vector2(direction.x() * size.x() / 2, direction.y() * size.y() / 2);
      const Box box = inside(Box{middle - size / 2, middle + size / 2});
      const double now = price(box, anchor);
      if (now < cheapest) {
        cheapest = now;
        best = box;
      }
    }
  boxes_.push_back(best);
  return best;
}

// `box` moved into the area. If it is too large, it begins at the area's top left corner.
Box LabelPlacement::inside(const Box& box) const {
  const Vector2 back = (box.high - area_.high).cwiseMax(0.0), on = (area_.low - (box.low - back)).cwiseMax(0.0);
  return {box.low - back + on, box.high - back + on};
}

double LabelPlacement::price(const Box& box, const Vector2& anchor) const {
  double sum = ((box.low + box.high) / 2 - anchor).norm();
  if (box.contains(anchor)) sum += 1500;
  const Box wide{box.low - Vector2(5, 4), box.high + Vector2(5, 4)};
  const auto [left, top] = square_of(wide.low);
  const auto [right, bottom] = square_of(wide.high);
  for (std::int32_t x = left; x <= right; ++x)
    for (std::int32_t y = top; y <= bottom; ++y)
      if (const auto found = points_.find(cell(x, y)); found != points_.end())
        for (const Vector2& p : found->second)
          if (wide.contains(p)) sum += 40;
  for (const Box& other : boxes_)
    if (wide.overlaps(other)) sum += 1500;
  return sum;
}

}  // namespace relmap::client
