// Finds which of many pixels lie near another one: they are sorted into square cells once, so that a search looks at
// few of them.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

#include "proto/geometry/geometry.h"

namespace relmap::place {

class PixelGrid {
 public:
  // `pixels` must outlive this. Those that are not finite, or a billion pixels away, are near nothing.
  explicit PixelGrid(std::span<const Vector2> pixels) : pixels_(pixels), sorted_(pixels.size()) {
    std::vector<std::uint32_t> bucket_of(pixels.size(), kNone);
    for (std::size_t p = 0; p < pixels.size(); ++p) {
      if (!(pixels[p].array().abs() < kFar).all()) continue;
      bucket_of[p] = bucket(cell(pixels[p].x()), cell(pixels[p].y()));
      ++first_[bucket_of[p]];
    }
    // Each begin is the end of its bucket first, and moves down while the bucket is filled.
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    for (std::size_t p = pixels.size(); p-- > 0;)
      if (bucket_of[p] != kNone) sorted_[--first_[bucket_of[p]]] = static_cast<std::uint32_t>(p);
  }

  // Calls visit(number) for each pixel less than `radius`, below a billion, from `at`, in no particular order.
  template <typename Visit>
  void visit_near(const Vector2& at, double radius, const Visit& visit) const {
    if (!(at.array().abs() + radius < kFar).all()) return;
    const std::int64_t left = cell(at.x() - radius), top = cell(at.y() - radius);
    // Cells that are kAcross apart share a bucket, which is looked through once.
    const std::int64_t right = std::min(cell(at.x() + radius), left + kAcross - 1);
    const std::int64_t bottom = std::min(cell(at.y() + radius), top + kAcross - 1);
    for (std::int64_t y = top; y <= bottom; ++y)
      for (std::int64_t x = left; x <= right; ++x) {
        const std::uint32_t b = bucket(x, y);
        for (std::uint32_t k = first_[b]; k < first_[b + 1]; ++k)
          if ((at - pixels_[sorted_[k]]).squaredNorm() < radius * radius) visit(sorted_[k]);
      }
  }

 private:
  static constexpr double kCellPixels = 16, kFar = 1e9;
  static constexpr std::int64_t kAcross = 64;  // buckets in a row and in a column; they repeat beyond
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};

  static std::int64_t cell(double coordinate) {
    return static_cast<std::int64_t>(std::floor(coordinate / kCellPixels));
  }
  static std::uint32_t bucket(std::int64_t x, std::int64_t y) {
    return static_cast<std::uint32_t>((y & (kAcross - 1)) * kAcross + (x & (kAcross - 1)));
  }

  std::span<const Vector2> pixels_;
  std::array<std::uint32_t, kAcross * kAcross + 1> first_{};  // by bucket, where it begins in sorted_
  std::vector<std::uint32_t> sorted_;
};

}  // namespace relmap::place
