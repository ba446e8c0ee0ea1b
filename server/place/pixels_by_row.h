// Finds which of many pixels lie near another one: they are sorted by row once, so that a search looks at few of them.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "proto/geometry/geometry.h"

namespace relmap::place {

class PixelsByRow {
  auto row() const {
    return [this](std::uint32_t p) { return pixels_[p].y(); };
  }

 public:
  // `pixels` must outlive this. Those that are not finite are near nothing.
  explicit PixelsByRow(std::span<const Vector2> pixels) : pixels_(pixels) {
    for (std::uint32_t p = 0; p < pixels.size(); ++p)
      if (pixels[p].allFinite()) order_.push_back(p);
    std::ranges::sort(order_, {}, row());
  }

  // Calls visit(number) for each pixel less than `radius` from `at`, row by row.
  template <typename Visit>
  void visit_near(const Vector2& at, double radius, const Visit& visit) const {
    for (auto p = std::ranges::lower_bound(order_, at.y() - radius, {}, row());
         p != order_.end() && pixels_[*p].y() <= at.y() + radius; ++p)
      if ((at - pixels_[*p]).squaredNorm() < radius * radius) visit(*p);
  }

 private:
  std::span<const Vector2> pixels_;
  std::vector<std::uint32_t> order_;
};

}  // namespace relmap::place
