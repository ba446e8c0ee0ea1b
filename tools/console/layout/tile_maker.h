// Cuts a layout into tiles.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "tools/console/layout/keyframe_lines.h"
#include "tools/console/layout/tile.h"
#include "tools/console/layout/tile_index.h"

namespace relmap::console {

struct TileContent {
  const MapLayout* old = nullptr;              // with positions in an older layout
  const std::vector<float>* sigmas = nullptr;  // by point: with standard deviations (root_sigmas.h)
  const KeyframeLines::Lines* keyframes =
      nullptr;  // beyond MapLayout::zooms; those of sessions that it lacks are left out
};

inline constexpr std::uint32_t kMoreZooms = 6;  // beyond MapLayout::zooms, with every keyframe
inline constexpr std::size_t kMaxVertices = 16'000, kMaxClosures = 2'000;  // of a tile
inline constexpr double kSuspicious = 0.5;

// `id.zoom` at most MapLayout::zooms + kMoreZooms, coordinates below TileIndex::tiles(). A tile of more than
// kMaxVertices is drawn more coarsely.
Tile make_tile(const TileIndex& index, const TileId& id, const TileContent& content = {});

// The sessions that have a line in the tile, ascending.
std::vector<SessionNumber> sessions_in(const TileIndex& index, const TileId& id);

}  // namespace relmap::console
