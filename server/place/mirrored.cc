#include "server/place/mirrored.h"

#include <numbers>
#include <string>

namespace relmap::place {

namespace {

constexpr std::size_t kCells = 4, kDirections = 8;  // of a SIFT descriptor: cells a side, directions a cell
// A mirrored picture never has so many inliers, whatever it shows.
constexpr std::uint32_t kBeyondDoubt = 4 * kMinInliers;

}  // namespace

std::vector<AppearanceFeature> mirrored(std::span<const AppearanceFeature> features, int width) {
  std::vector<AppearanceFeature> result(features.begin(), features.end());
  for (AppearanceFeature& feature : result) {
    feature.u = static_cast<float>(width - 1) - feature.u;
    feature.angle = std::numbers::pi_v<float> - feature.angle;
    const auto descriptor = feature.descriptor;
    for (std::size_t row = 0; row < kCells; ++row)
      for (std::size_t column = 0; column < kCells; ++column)
        for (std::size_t direction = 0; direction < kDirections; ++direction)
          feature.descriptor[(row * kCells + column) * kDirections + direction] =
              descriptor[((kCells - 1 - row) * kCells + column) * kDirections +
                         (kDirections - direction) % kDirections];
  }
  return result;
}

Status check_not_mirrored(const storage::Graph& graph, const QueryPicture& query, const VerifiedPlace& place,
                          std::uint64_t seed) {
  if (query.pair || place.inliers >= kBeyondDoubt || !storage::is_metric(place.verification)) return {};
  const auto features = mirrored(query.features, query.camera.width);
  QueryPicture other = query;
  other.features = features;
  other.camera.cx = query.camera.width - 1 - query.camera.cx;
  other.camera.baseline = 0;
  // Counts features even if the camera is contradicted there.
  const std::size_t fits = try_place(graph, other, place.match, seed).features.size();
  if (fits <= place.inliers) return {};
  return {Reason::NO_CALIBRATION, "the picture seems to be mirrored: at " + place.match.to_string() + " " +
                                      std::to_string(place.inliers) + " of its features fit, but " +
                                      std::to_string(fits) +
                                      " of its mirror image; ask with the picture as the camera took it"};
}

}  // namespace relmap::place
