#include "server/place/descriptor_match.h"

#include <algorithm>
#include <limits>
#include <unordered_map>

#include "proto/geometry/covariance.h"

namespace relmap::place {
namespace {

bool one_point(const MapPoint& p, const MapPoint& q) {
  if (p.landmark.valid() && p.landmark == q.landmark) return true;
  const double floor = 0.01 * p.point.norm();
  const Matrix3 covariance = p.covariance + q.covariance + floor * floor * Matrix3::Identity();
  const Vector3 apart = p.point - q.point;
  return mahalanobis_squared(apart, covariance) < 16;
}

std::uint32_t nearest(const std::uint32_t* distances, std::size_t count, std::size_t step) {
  std::uint32_t best = 0;
  for (std::uint32_t i = 1; i < count; ++i)
    if (distances[i * step] < distances[best * step]) best = i;
  return best;
}

// Keeps the best match of each landmark, since two features may have matched two views of it.
std::vector<DescriptorMatch> nearest_of_each_landmark(const std::vector<DescriptorMatch>& matches,
                                                      std::span<const MapPoint> points) {
  std::unordered_map<LandmarkId, std::size_t> best;
  const auto landmark_of = [&](std::size_t i) { return points[matches[i].point].landmark; };
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (!landmark_of(i).valid()) continue;
    const auto [held, fresh] = best.emplace(landmark_of(i), i);
    if (!fresh && matches[i].distance < matches[held->second].distance) held->second = i;
  }
  std::vector<DescriptorMatch> result;
  for (std::size_t i = 0; i < matches.size(); ++i)
    if (!landmark_of(i).valid() || best.at(landmark_of(i)) == i) result.push_back(matches[i]);
  return result;
}

}  // namespace

std::vector<DescriptorMatch> match_descriptors(std::span<const AppearanceFeature> features,
                                               std::span<const Descriptor* const> points,
                                               const std::function<bool(std::uint32_t, std::uint32_t)>& same,
                                               const PossiblePairs& possible) {
  if (features.empty() || points.empty()) return {};
  constexpr std::uint32_t kImpossible = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> distances(features.size() * points.size(), kImpossible);
  for (std::uint32_t f = 0; f < features.size(); ++f)
    for (std::uint32_t p = 0; p < points.size(); ++p)
      if (!possible || possible(f, p))
        distances[f * points.size() + p] = squared_distance(features[f].descriptor, *points[p]);

  std::vector<DescriptorMatch> matches;
  for (std::uint32_t f = 0; f < features.size(); ++f) {
    const std::uint32_t* row = &distances[f * points.size()];
    const std::uint32_t p = nearest(row, points.size(), 1);
    if (row[p] > kMaxDescriptorDistance) continue;
    if (nearest(&distances[p], features.size(), points.size()) != f) continue;
    const double rival = row[p] / (kDescriptorRatio * kDescriptorRatio);
    bool clear = true;
    for (std::uint32_t other = 0; clear && other < points.size(); ++other)
      clear = row[other] > rival || other == p || same(p, other);
    if (clear) matches.push_back({f, p, row[p]});
  }
  return matches;
}

std::vector<DescriptorMatch> match_points(std::span<const AppearanceFeature> features, std::span<const MapPoint> points,
                                          const PossiblePairs& possible) {
  std::vector<const Descriptor*> descriptors;
  for (const MapPoint& point : points) descriptors.push_back(point.descriptor);
  const auto matches = match_descriptors(
      features, descriptors, [&](std::uint32_t p, std::uint32_t q) { return one_point(points[p], points[q]); },
      possible);
  return nearest_of_each_landmark(matches, points);
}

}  // namespace relmap::place
