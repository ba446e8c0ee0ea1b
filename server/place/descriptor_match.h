// Which feature of a query is which point of the map, by descriptor alone.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "proto/keyframe/keyframe.h"
#include "server/place/map_points.h"

namespace relmap::place {

struct DescriptorMatch {
  std::uint32_t feature;   // of the query
  std::uint32_t point;     // of the map
  std::uint32_t distance;  // squared
};

// Lowe's ratio of distances, nearest to second nearest; and the distance beyond which nothing is alike.
inline constexpr double kDescriptorRatio = 0.8;
inline constexpr std::uint32_t kMaxDescriptorDistance = 270 * 270;  // squared; a descriptor's norm is 512

// Mutual nearest neighbours that pass the ratio test. `same(p, q)`: two of the points are one, and do not compete.
// `possible(f, p)`: feature f could be point p; empty: each could. Ascending by feature.
using PossiblePairs = std::function<bool(std::uint32_t, std::uint32_t)>;
std::vector<DescriptorMatch> match_descriptors(std::span<const AppearanceFeature> features,
                                               std::span<const Descriptor* const> points,
                                               const std::function<bool(std::uint32_t, std::uint32_t)>& same,
                                               const PossiblePairs& possible = {});

// A point of the world stands in the map once for each frame that saw it: points with one landmark, or within each
// other's covariance, are one. A landmark is matched at most once.
std::vector<DescriptorMatch> match_points(std::span<const AppearanceFeature> features, std::span<const MapPoint> points,
                                          const PossiblePairs& possible = {});

}  // namespace relmap::place
