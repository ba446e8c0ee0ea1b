#include "server/place/changes.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "server/place/picture_cells.h"

namespace relmap::place {

Changes changes(std::span<const SoughtLandmark> sought, const StereoCamera& camera) {
  constexpr double kMaxFound = 0.95;      // a share of 1 would compare cells with a single landmark
  constexpr double kNoneByChance = 0.01;  // probability that nothing is found in a cell that has not changed
  constexpr int kMinCells = 8;
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

}  // namespace relmap::place
