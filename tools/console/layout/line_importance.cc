#include "tools/console/layout/line_importance.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace relmap::console {
namespace {

struct Span {
  std::size_t first = 0, last = 0;  // vertices, inclusive
  float most = 0;                   // the importance of the vertex at which a longer span was divided
};

}  // namespace

double distance_from_segment(const Vector2& point, const Vector2& a, const Vector2& b) {
  const Vector2 along = b - a;
  const double squared = along.squaredNorm();
  const double share = squared > 0 ? std::clamp((point - a).dot(along) / squared, 0.0, 1.0) : 0;
  return (point - (a + share * along)).norm();
}

std::vector<float> line_importance(std::span<const Vector2> line) {
  constexpr float kAlways = std::numeric_limits<float>::infinity();
  std::vector<float> importance(line.size(), 0);
  if (line.empty()) return importance;
  std::vector<Span> open;
  for (std::size_t first = 0; first + 1 < line.size(); first += kImportanceBlock) {
    const std::size_t last = std::min(first + kImportanceBlock, line.size() - 1);
    importance[last] = kAlways;
    open.push_back({first, last, kAlways});
  }
  importance[0] = importance.back() = kAlways;
  while (!open.empty()) {
    const Span span = open.back();
    open.pop_back();
    if (span.last - span.first < 2) continue;
    std::size_t farthest = span.first + 1;
    double most = -1;
    for (std::size_t k = span.first + 1; k < span.last; ++k) {
      const double off = distance_from_segment(line[k], line[span.first], line[span.last]);
      if (off > most) {
        most = off;
        farthest = k;
      }
    }
    // Rounded up, so that a tolerance below it divides the span.
    const float off = std::nextafter(static_cast<float>(most), kAlways);
    importance[farthest] = std::min(span.most, off);
    open.push_back({span.first, farthest, importance[farthest]});
    open.push_back({farthest, span.last, importance[farthest]});
  }
  return importance;
}

}  // namespace relmap::console
