// Places the texts of a map so that they hide neither the map nor each other.
#pragma once

#include <cstdint>
#include <unordered_map>
#include <utility>
#include <vector>

#include "client/map_plan.h"
#include "proto/geometry/geometry.h"

namespace relmap::client {

class LabelPlacement {
 public:
  // Texts stay within `area`.
  explicit LabelPlacement(const Box& area) : area_(area) {}

  void avoid(const Vector2& point) { points_[cell_of(point)].push_back(point); }
  void avoid(const Box& box) { boxes_.push_back(box); }
  // Returns the box for a text of this size that belongs to `anchor`. Later texts avoid it.
  Box place(const Vector2& anchor, const Vector2& size);

 private:
  static constexpr double kCell = 16;  // points are looked up by squares of the page
  static std::uint64_t cell(std::int32_t x, std::int32_t y) {
    return (std::uint64_t{static_cast<std::uint32_t>(x)} << 32) | static_cast<std::uint32_t>(y);
  }
  static std::pair<std::int32_t, std::int32_t> square_of(const Vector2& point);
  static std::uint64_t cell_of(const Vector2& point) {
    const auto [x, y] = square_of(point);
    return cell(x, y);
  }
  Box inside(const Box& box) const;
  double price(const Box& box, const Vector2& anchor) const;

  Box area_;
  std::unordered_map<std::uint64_t, std::vector<Vector2>> points_;  // by cell
  std::vector<Box> boxes_;
};

}  // namespace relmap::client
