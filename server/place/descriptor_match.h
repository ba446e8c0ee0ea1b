// Matches the features of a query to points of the map by their descriptors.
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

// Lowe's ratio test: the largest ratio of the nearest distance to the second nearest; and the largest distance of a
// match.
inline constexpr double kDescriptorRatio = 0.8;
inline constexpr std::uint32_t kMaxDescriptorDistance = 270 * 270;  // squared; a descriptor's norm is 512

// A feature that shows a point is at most this far from where a good pose projects the point, as a share of the
// picture's width.
inline constexpr double kNearRadius = 0.02;

// Where a model of the pictures, such as a pose, expects the points: a feature may be a point if it is less than
// `radius` from there (pixels).
struct ExpectedPoints {
  std::vector<Vector2> at;  // by point
  double radius = 0;
};

// Returns mutual nearest neighbours that pass the ratio test, ascending by feature. `same(p, q)` says that points p and
// q are one point of the world, so that they do not compete in the ratio test. If `expected` is null, every feature may
// be every point.
std::vector<DescriptorMatch> match_descriptors(std::span<const AppearanceFeature> features,
                                               std::span<const Descriptor* const> points,
                                               const std::function<bool(std::uint32_t, std::uint32_t)>& same,
                                               const ExpectedPoints* expected = nullptr);

// The same for map points. A point of the world is in the map once for each frame that saw it, so points that share a
// landmark, or that coincide within their covariances, count as one. A landmark is matched at most once.
std::vector<DescriptorMatch> match_points(std::span<const AppearanceFeature> features, std::span<const MapPoint> points,
                                          const ExpectedPoints* expected = nullptr);

// Of matches of the same features with the same points, found in several ways, keeps the nearest of each feature, point
// and landmark. Ascending by feature.
std::vector<DescriptorMatch> nearest_of_all(std::vector<DescriptorMatch> matches, std::span<const MapPoint> points);

// Drops the matches whose feature looks more like one of the first `rivals` points, by the ratio of the ratio test,
// unless that is the same point of the world. Among points that are expected near a feature one is always the nearest,
// whether or not it is the right one; among all points of a picture the right one, if it is there, is much nearer than
// the others. One that is only just nearer says nothing: from another viewpoint the right point looks little more alike
// than the best of hundreds.
void drop_outdone(std::span<const AppearanceFeature> features, std::span<const MapPoint> points, std::size_t rivals,
                  std::vector<DescriptorMatch>& matches);

// match_points() among pairs of one word, which cost a hundredth of all pairs and hold a tenth to a quarter of the
// matches. `words` are those of the features, one each.
std::vector<DescriptorMatch> match_points_by_word(std::span<const AppearanceFeature> features,
                                                  std::span<const std::uint32_t> words,
                                                  std::span<const MapPoint> points);

}  // namespace relmap::place
