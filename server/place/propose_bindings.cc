#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <unordered_set>

#include "proto/geometry/covariance.h"
#include "server/place/binding_proposal.h"
#include "server/place/descriptor_match.h"
#include "server/place/map_points.h"
#include "server/place/verify.h"
#include "storage/graph/binding.h"

namespace relmap::place {
namespace {

constexpr double kChi2With2At99 = 9.21;
constexpr double kChi2With3At99 = 11.34;

// A landmark from around the match, with all its views there.
struct Target {
  std::vector<const Descriptor*> views;
  ExpectedPixel expected;
};

bool inside_gate(const AppearanceFeature& feature, const StereoCamera& camera, const Target& target) {
  const StereoPixel z = pixel_of(feature, camera);
  const double sigma = pixel_sigma(level_of_scale(feature.scale));  // at least 1: the gate is never under 3 px
  const Vector3 residual = z - target.expected.pixel;
  const Matrix3 S = target.expected.covariance + sigma * sigma * Matrix3::Identity();
  if (is_mono(z)) {
    const Eigen::Matrix2d S2 = S.topLeftCorner<2, 2>();
    const Vector2 r = residual.head<2>();
    return mahalanobis_squared(r, S2) <= kChi2With2At99;
  }
  return mahalanobis_squared(residual, S) <= kChi2With3At99;
}

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
  for (const MapPoint& point : map.points) {
    if (!point.landmark.valid() || recent(point.landmark.base) || seen.landmarks.contains(point.landmark)) continue;
    const auto [entry, fresh] = targets.try_emplace(point.landmark);
    // Frames come nearest first, so the first view of a landmark predicts its position best.
    if (fresh)
      if (const auto expected = expect(point.point, point.covariance, query.camera, T_frame_match, covariance))
        entry->second = Target{{}, *expected};
    if (entry->second) entry->second->views.push_back(point.descriptor);
  }

  // A track that continues an old landmark is bound already.
  const auto free = [&](const AppearanceFeature& feature) {
    return feature.track < 0 || static_cast<std::size_t>(feature.track) >= seen.of_track.size() ||
           recent(seen.of_track[static_cast<std::size_t>(feature.track)].base);
  };

  struct Best {
    LandmarkId landmark;
    std::uint32_t distance = std::numeric_limits<std::uint32_t>::max();
  };
  std::vector<Best> of_feature(query.features.size());
  for (const auto& [landmark, target] : targets) {
    if (!target) continue;
    std::size_t best = 0;
    std::uint32_t first = std::numeric_limits<std::uint32_t>::max(), second = first;
    for (std::size_t f = 0; f < query.features.size(); ++f) {
      if (!free(query.features[f]) || !inside_gate(query.features[f], query.camera, *target)) continue;
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
    if (first < of_feature[best].distance) of_feature[best] = {landmark, first};
  }

  std::vector<storage::ProposedBinding> bindings;
  for (std::size_t f = 0; f < of_feature.size(); ++f)
    if (of_feature[f].landmark.valid())
      bindings.push_back(binding_to(of_feature[f].landmark, query.features[f], query.camera));
  return bindings;
}

}  // namespace relmap::place
