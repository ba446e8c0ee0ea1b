#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <unordered_set>
#include <utility>

#include "proto/geometry/covariance.h"
#include "server/place/binding_proposal.h"
#include "server/place/descriptor_match.h"
#include "server/place/map_points.h"
#include "server/place/pixel_grid.h"
#include "server/place/verify.h"
#include "storage/graph/binding.h"

namespace relmap::place {
namespace {

constexpr double kChi2With2At99 = 9.21;
constexpr double kChi2With3At99 = 11.34;

// A landmark from around the match, with all its views there.
struct Target {
  std::uint32_t point = 0;  // of the map, the first of its views
  std::vector<const Descriptor*> views;
  ExpectedPixel expected;
};

// The features of a query that may be bound, by the level at which they were measured: where few levels are coarse, the
// gates of most stay small.
class Bindable {
 public:
  template <typename Free>
  Bindable(const QueryPicture& query, const Free& free) {
    std::map<int, std::vector<std::uint32_t>> by_level;
    for (std::uint32_t f = 0; f < query.features.size(); ++f) {
      measured_.push_back(pixel_of(query.features[f], query.camera));
      if (free(query.features[f])) by_level[level_of_scale(query.features[f].scale)].push_back(f);
    }
    for (auto& [level, features] : by_level) levels_.push_back(std::make_unique<Level>(level, features, measured_));
  }

  // Appends the features inside the target's gate, ascending.
  void find_inside_gate(const Target& target, std::vector<std::uint32_t>& found) const {
    const Matrix3& expected = target.expected.covariance;
    for (const std::unique_ptr<const Level>& level : levels_) {
      const double variance = level->sigma * level->sigma;  // at least 1: the gate is never under 3 px
      const double radius = std::sqrt(kChi2With3At99 * (expected(0, 0) + expected(1, 1) + variance));
      level->grid.visit_near(target.expected.pixel.head<2>(), radius, [&](std::uint32_t at) {
        if (inside_gate(measured_[level->features[at]], variance, target)) found.push_back(level->features[at]);
      });
    }
    std::ranges::sort(found);
  }

 private:
  struct Level {
    Level(int level, std::vector<std::uint32_t> its_features, std::span<const StereoPixel> measured)
        : sigma(pixel_sigma(level)), features(std::move(its_features)), pixels(pixels_of(features, measured)) {}

    static std::vector<Vector2> pixels_of(std::span<const std::uint32_t> features,
                                          std::span<const StereoPixel> measured) {
      std::vector<Vector2> pixels;
      for (const std::uint32_t f : features) pixels.push_back(measured[f].head<2>());
      return pixels;
    }

    const double sigma;
    const std::vector<std::uint32_t> features;
    const std::vector<Vector2> pixels;
    const PixelGrid grid{pixels};
  };

  static bool inside_gate(const StereoPixel& z, double variance, const Target& target) {
    const Vector3 residual = z - target.expected.pixel;
    const Matrix3 S = target.expected.covariance + variance * Matrix3::Identity();
    if (is_mono(z)) {
      const Eigen::Matrix2d S2 = S.topLeftCorner<2, 2>();
      const Vector2 r = residual.head<2>();
      return mahalanobis_squared(r, S2) <= kChi2With2At99;
    }
    return mahalanobis_squared(residual, S) <= kChi2With3At99;
  }

  std::vector<StereoPixel> measured_;
  std::vector<std::unique_ptr<const Level>> levels_;
};

std::uint32_t distance(const AppearanceFeature& feature, const Target& target) {
  std::uint32_t best = std::numeric_limits<std::uint32_t>::max();
  for (const Descriptor* view : target.views) best = std::min(best, squared_distance(feature.descriptor, *view));
  return best;
}

}  // namespace

std::vector<storage::ProposedBinding> propose_bindings(const storage::Graph& graph, const QueryPicture& query,
                                                       FrameId frame, FrameId match, const SE3& T_match_frame,
                                                       const Matrix6& covariance, std::uint32_t first_maskable) {
  const auto recent = [&](FrameId id) { return id.session == frame.session && id.index >= first_maskable; };
  const MapPoints map = gather_points(graph, match, kBindingReach, recent);
  const SeenLandmarks seen = seen_by(graph, frame);
  const SE3 T_frame_match = T_match_frame.inverse();

  std::map<LandmarkId, std::optional<Target>> targets;
  for (std::uint32_t p = 0; p < map.points.size(); ++p) {
    const MapPoint& point = map.points[p];
    if (!point.landmark.valid() || recent(point.landmark.base) || seen.landmarks.contains(point.landmark)) continue;
    const auto [entry, fresh] = targets.try_emplace(point.landmark);
    // Frames come nearest first, so the first view of a landmark predicts its position best.
    if (fresh)
      if (const auto expected = expect(point.point, point.covariance, query.camera, T_frame_match, covariance))
        entry->second = Target{p, {}, *expected};
    if (entry->second) entry->second->views.push_back(point.descriptor);
  }

  // A track that continues an old landmark is bound already.
  const auto free = [&](const AppearanceFeature& feature) {
    return feature.track < 0 || static_cast<std::size_t>(feature.track) >= seen.of_track.size() ||
           recent(seen.of_track[static_cast<std::size_t>(feature.track)].base);
  };

  const Bindable bindable(query, free);
  std::vector<std::uint32_t> inside;
  constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  std::vector<DescriptorMatch> of_feature;
  for (std::uint32_t f = 0; f < query.features.size(); ++f) of_feature.push_back({f, kNone, kNone});
  for (const auto& [landmark, target] : targets) {
    if (!target) continue;
    std::size_t best = 0;
    std::uint32_t first = std::numeric_limits<std::uint32_t>::max(), second = first;
    inside.clear();
    bindable.find_inside_gate(*target, inside);
    for (const std::uint32_t f : inside) {
      const std::uint32_t d = distance(query.features[f], *target);
      if (d < first) {
        second = first;
        first = d;
        best = f;
      } else {
        second = std::min(second, d);
      }
    }
    if (first > kMaxDescriptorDistance || first > kDescriptorRatio * kDescriptorRatio * second) continue;
    if (first >= of_feature[best].distance) continue;
    of_feature[best].point = target->point;
    of_feature[best].distance = first;
  }

  std::erase_if(of_feature, [](const DescriptorMatch& none) { return none.point == kNone; });
  drop_outdone(query.features, map.points, points_of_centre(map), of_feature);
  std::vector<storage::ProposedBinding> bindings;
  for (const auto& [f, p, d] : of_feature)
    bindings.push_back(binding_to(map.points[p].landmark, query.features[f], query.camera));
  return bindings;
}

}  // namespace relmap::place
