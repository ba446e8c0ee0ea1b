// How much each vertex of a line matters for its shape (Douglas and Peucker, "Algorithms for the reduction of the
// number of points required to represent a digitized line", 1973), computed once for all scales.
#pragma once

#include <span>
#include <vector>

#include "proto/geometry/geometry.h"

namespace relmap::console {

// For each vertex a distance in metres: the line through those vertices whose importance is above any tolerance is
// nowhere farther than this tolerance from the vertices that it leaves out. The ends have infinite importance, and so
// has one vertex in kImportanceBlock, which bounds the time.
inline constexpr std::size_t kImportanceBlock = 1024;
std::vector<float> line_importance(std::span<const Vector2> line);

// The distance of a point from a segment.
double distance_from_segment(const Vector2& point, const Vector2& a, const Vector2& b);

}  // namespace relmap::console
