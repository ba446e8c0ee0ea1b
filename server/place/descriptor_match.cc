#include "server/place/descriptor_match.h"

#include <algorithm>
#include <limits>
#include <unordered_set>

#include "proto/geometry/covariance.h"
#include "server/place/descriptor_sketch.h"
#include "server/place/pixel_grid.h"

namespace relmap::place {
namespace {

bool one_point(const MapPoint& p, const MapPoint& q) {
  if (p.landmark.valid() && p.landmark == q.landmark) return true;
  const double floor = 0.01 * p.point.norm();
  const Matrix3 covariance = p.covariance + q.covariance + floor * floor * Matrix3::Identity();
  const Vector3 apart = p.point - q.point;
  return mahalanobis_squared(apart, covariance) < 16;
}

struct Nearest {
  std::uint32_t index = 0, distance = std::numeric_limits<std::uint32_t>::max();

  // Of equally near ones the first that was offered is kept.
  void offer(std::uint32_t other, std::uint32_t its_distance) {
    if (its_distance < distance) *this = {other, its_distance};
  }
};

// Returns mutual nearest neighbours that pass the ratio test. `possible(max, f)` returns the points, ascending, that
// feature f may be, all of those within the squared distance `max` among them.
template <typename Same, typename Possible>
std::vector<DescriptorMatch> match(std::span<const AppearanceFeature> features,
                                   std::span<const Descriptor* const> points, const Same& same,
                                   const Possible& possible) {
  const auto visit_within = [&](std::uint32_t max, std::uint32_t f, const auto& visit) {
    for (const std::uint32_t p : possible(max, f))
      if (const std::uint32_t d = squared_distance(features[f].descriptor, *points[p]); d <= max) visit(p, d);
  };
  std::vector<Nearest> point_of(features.size()), feature_of(points.size());
  for (std::uint32_t f = 0; f < features.size(); ++f)
    visit_within(kMaxDescriptorDistance, f, [&](std::uint32_t p, std::uint32_t distance) {
      point_of[f].offer(p, distance);
      feature_of[p].offer(f, distance);
    });

  std::vector<DescriptorMatch> matches;
  for (std::uint32_t f = 0; f < features.size(); ++f) {
    const std::uint32_t p = point_of[f].index, distance = point_of[f].distance;
    if (distance > kMaxDescriptorDistance || feature_of[p].index != f) continue;
    const auto rival = static_cast<std::uint32_t>(distance / (kDescriptorRatio * kDescriptorRatio));
    bool clear = true;
    visit_within(rival, f,
                 [&](std::uint32_t other, std::uint32_t) { clear = clear && (other == p || same(p, other)); });
    if (clear) matches.push_back({f, p, distance});
  }
  return matches;
}

std::vector<const Descriptor*> descriptors_of(std::span<const MapPoint> points) {
  std::vector<const Descriptor*> descriptors;
  for (const MapPoint& point : points) descriptors.push_back(point.descriptor);
  return descriptors;
}

// Whether two points of the map are one point of the world.
struct SamePoint {
  std::span<const MapPoint> points;
  bool operator()(std::uint32_t p, std::uint32_t q) const { return one_point(points[p], points[q]); }
};

}  // namespace

std::vector<DescriptorMatch> match_descriptors(std::span<const AppearanceFeature> features,
                                               std::span<const Descriptor* const> points,
                                               const std::function<bool(std::uint32_t, std::uint32_t)>& same,
                                               const ExpectedPoints* expected) {
  // Where few points are possible, their distances cost less than sketches do.
  if (expected) {
    const PixelGrid grid(expected->at);
    std::vector<std::uint32_t> near;
    return match(features, points, same, [&](std::uint32_t, std::uint32_t f) {
      near.clear();
      const Vector2 seen(features[f].u, features[f].v);
      grid.visit_near(seen, expected->radius, [&](std::uint32_t p) { near.push_back(p); });
      std::sort(near.begin(), near.end());
      return std::span<const std::uint32_t>(near);
    });
  }
  const DescriptorSketches of_points(points);
  std::vector<DescriptorSketch> of_features;
  for (const AppearanceFeature& feature : features) of_features.push_back(sketch(feature.descriptor));
  std::vector<std::uint32_t> near;
  return match(features, points, same, [&](std::uint32_t max, std::uint32_t f) {
    near.clear();
    of_points.find_near(of_features[f], max, near);
    return std::span<const std::uint32_t>(near);
  });
}

std::vector<DescriptorMatch> match_points(std::span<const AppearanceFeature> features, std::span<const MapPoint> points,
                                          const ExpectedPoints* expected) {
  return nearest_of_all(match_descriptors(features, descriptors_of(points), SamePoint{points}, expected), points);
}

std::vector<DescriptorMatch> match_points_by_word(std::span<const AppearanceFeature> features,
                                                  std::span<const std::uint32_t> words,
                                                  std::span<const MapPoint> points) {
  std::vector<std::uint32_t> order;
  for (std::uint32_t p = 0; p < points.size(); ++p)
    if (points[p].word != kNoWord) order.push_back(p);
  const auto word = [&](std::uint32_t p) { return points[p].word; };
  std::ranges::stable_sort(order, {}, word);
  const auto of_word = [&](std::uint32_t, std::uint32_t f) {
    const auto first = std::ranges::lower_bound(order, words[f], {}, word);
    const auto last = std::ranges::upper_bound(first, order.end(), words[f], {}, word);
    return std::span<const std::uint32_t>(first, last);
  };
  return nearest_of_all(match(features, descriptors_of(points), SamePoint{points}, of_word), points);
}

void drop_outdone(std::span<const AppearanceFeature> features, std::span<const MapPoint> points, std::size_t rivals,
                  std::vector<DescriptorMatch>& matches) {
  std::erase_if(matches, [&](const DescriptorMatch& match) {
    const Descriptor& seen = features[match.feature].descriptor;
    return std::ranges::any_of(points.first(rivals), [&](const MapPoint& rival) {
      return squared_distance(seen, *rival.descriptor) < kDescriptorRatio * kDescriptorRatio * match.distance &&
             !one_point(rival, points[match.point]);
    });
  });
}

std::vector<DescriptorMatch> nearest_of_all(std::vector<DescriptorMatch> matches, std::span<const MapPoint> points) {
  std::ranges::stable_sort(matches, {}, &DescriptorMatch::distance);
  std::unordered_set<std::uint32_t> features, taken;
  std::unordered_set<LandmarkId> landmarks;
  std::erase_if(matches, [&](const DescriptorMatch& match) {
    const LandmarkId landmark = points[match.point].landmark;
    if (features.contains(match.feature) || taken.contains(match.point) || landmarks.contains(landmark)) return true;
    features.insert(match.feature);
    taken.insert(match.point);
    if (landmark.valid()) landmarks.insert(landmark);
    return false;
  });
  std::ranges::sort(matches, {}, &DescriptorMatch::feature);
  return matches;
}

}  // namespace relmap::place
