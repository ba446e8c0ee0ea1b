// Lines as they are cut at the edges of a tile.
#pragma once

#include "tools/console/layout/tile.h"
#include "tools/console/layout/tile_index.h"

namespace relmap::console {

// A vertex before it is cut.
struct LineVertex {
  Vector2 at = Vector2::Zero();   // in the world
  Vector2 old = Vector2::Zero();  // in an older layout
  double sigma = 0;
  std::uint32_t index = 0, time_s = 0;
  std::uint8_t flags = 0;
};

// Adds to a tile what lies in it of lines that are given vertex by vertex.
class TileLines {
 public:
  // `box`: of the tile. Sets the tile's origin and unit.
  TileLines(const LayoutBox& box, Tile& tile);

  void begin(SessionNumber session, std::uint32_t part);
  void add(const LineVertex& vertex);
  void end();  // of the line

 private:
  void emit(const LineVertex& vertex);
  void emit_cut(const LineVertex& from, const LineVertex& to, double share);

  const LayoutBox box_, beyond_;  // the tile, and with half a tile around it
  Tile& tile_;
  Tile::Run run_;
  LineVertex before_;
  bool any_ = false;    // a vertex of this line was given
  bool drawn_ = false;  // something of this line was added
  bool open_ = false;   // the vertex before is the last one that was added
};

// The position in units from a tile's origin, on a lattice that all tiles of the same zoom share.
std::uint16_t in_units(double metres, double origin, double unit);

}  // namespace relmap::console
