#include "server/place/differs.h"

#include <algorithm>
#include <array>

#include "server/place/descriptor_match.h"
#include "server/place/map_points.h"
#include "server/place/picture_cells.h"

namespace relmap::place {
namespace {

constexpr int kMinPerCell = 3;
constexpr int kMinCells = 8;
constexpr double kNearRadius = 0.02;     // of the picture's width
constexpr double kMaxNearer = 1.5;       // ratio of viewing distances beyond which a feature looks different
constexpr double kOnePointPixels = 1.5;  // points of a cell that are closer together than this count once

struct Cell {
  std::vector<Vector2> expected;
  int features = 0;
  bool found = false;
};

}  // namespace

float differing_share(const storage::Graph& graph, const QueryPicture& query, const VerifiedPlace& place) {
  if (!storage::is_metric(place.verification) || !(query.camera.f > 0)) return -1;
  std::array<Cell, kPictureCells> cells;
  const auto cell_of = [&](double u, double v) -> Cell& { return cells[picture_cell(query.camera, u, v)]; };
  for (const AppearanceFeature& feature : query.features) ++cell_of(feature.u, feature.v).features;

  const MapPoints map = gather_points(graph, place.match, kViewReach);
  const SE3 T_query_match = place.T_match_query.inverse();
  const double radius = kNearRadius * query.camera.width;
  for (const MapPoint& point : map.points) {
    const Vector3 p = T_query_match * point.point;
    const double depth = (map.frames[point.placed].T_centre_frame.inverse() * point.point).z();
    if (!(p.z() > 0) || depth > kMaxNearer * p.z() || p.z() > kMaxNearer * depth) continue;
    const Vector2 at = query.camera.project(p).head<2>();
    if (!query.camera.in_picture(at.x(), at.y())) continue;
    Cell& cell = cell_of(at.x(), at.y());
    const auto there = [&](const Vector2& other) { return (other - at).norm() < kOnePointPixels; };
    if (std::none_of(cell.expected.begin(), cell.expected.end(), there)) cell.expected.push_back(at);
    for (const AppearanceFeature& feature : query.features) {
      const Vector2 seen(feature.u, feature.v);
      if ((seen - at).squaredNorm() < radius * radius &&
          squared_distance(feature.descriptor, *point.descriptor) <= kMaxDescriptorDistance)
        cell.found = cell_of(seen.x(), seen.y()).found = true;
    }
  }
  int both = 0, differ = 0;
  for (const Cell& cell : cells) {
    if (cell.features < kMinPerCell || cell.expected.size() < static_cast<std::size_t>(kMinPerCell)) continue;
    ++both;
    differ += !cell.found;
  }
  return both < kMinCells ? -1 : static_cast<float>(differ) / static_cast<float>(both);
}

}  // namespace relmap::place
