#include "server/place/changes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "server/place/descriptor_match.h"
#include "server/place/map_points.h"
#include "server/place/pixel_grid.h"

namespace relmap::place {
namespace {

constexpr int kMinCells = 8;  // fewer compared ones tell nothing

// Of landmarks.
constexpr double kMaxFound = 0.95;      // a share of 1 would compare cells with a single landmark
constexpr double kNoneByChance = 0.01;  // probability that nothing is found in a cell that has not changed

// Of features.
constexpr int kMinPerCell = 3;
constexpr double kOnePointPixels = 1.5;  // points of a cell that are closer together than this count once

// The cell of a pixel of the left picture. A pixel outside the picture is counted in the nearest cell.
std::size_t picture_cell(const StereoCamera& camera, double u, double v) {
  const int column = std::clamp(static_cast<int>((u + 0.5) / camera.width * kPictureColumns), 0, kPictureColumns - 1);
  const int row = std::clamp(static_cast<int>((v + 0.5) / camera.height * kPictureRows), 0, kPictureRows - 1);
  return static_cast<std::size_t>(row * kPictureColumns + column);
}

}  // namespace

Changes changes(std::span<const SoughtLandmark> sought, const StereoCamera& camera) {
  struct Cell {
    int sought = 0, found = 0;
  };
  std::array<Cell, kPictureCells> cells;
  for (const SoughtLandmark& landmark : sought) {
    Cell& cell = cells[picture_cell(camera, landmark.expected.x(), landmark.expected.y())];
    ++cell.sought;
    cell.found += landmark.found;
  }
  Cell where_any;
  for (const Cell& cell : cells)
    if (cell.found > 0) where_any.sought += cell.sought, where_any.found += cell.found;
  if (where_any.found == 0) return {};
  const double share = std::min(kMaxFound, static_cast<double>(where_any.found) / where_any.sought);
  Changes result;
  for (const Cell& cell : cells) {
    if (std::pow(1 - share, cell.sought) >= kNoneByChance) continue;
    ++result.compared;
    result.changed += cell.found == 0;
  }
  return result.compared < kMinCells ? Changes{} : result;
}

float differing_share(const storage::Graph& graph, const QueryPicture& query, const VerifiedPlace& place) {
  if (!storage::is_metric(place.verification) || !(query.camera.f > 0)) return -1;
  struct Cell {
    std::vector<Vector2> expected;
    int features = 0;
    bool found = false;
  };
  std::array<Cell, kPictureCells> cells;
  const auto cell_of = [&](double u, double v) -> Cell& { return cells[picture_cell(query.camera, u, v)]; };
  for (const AppearanceFeature& feature : query.features) ++cell_of(feature.u, feature.v).features;
  std::vector<Vector2> pixels;
  for (const AppearanceFeature& feature : query.features) pixels.emplace_back(feature.u, feature.v);
  const PixelGrid grid(pixels);

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
    grid.visit_near(at, radius, [&](std::uint32_t f) {
      Cell& of_feature = cell_of(pixels[f].x(), pixels[f].y());
      if (cell.found && of_feature.found) return;
      if (squared_distance(query.features[f].descriptor, *point.descriptor) <= kMaxDescriptorDistance)
        cell.found = of_feature.found = true;
    });
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
