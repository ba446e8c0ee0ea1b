// Which lines and closures of a layout are in which tile, for each zoom to MapLayout::zooms. Immutable, of about 12
// bytes for each point and zoom: a segment that goes over very many tiles is listed once, and looked at for each tile.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "tools/console/layout/map_layout.h"

namespace relmap::console {

struct TileId {
  std::uint32_t zoom = 0, x = 0, y = 0;

  auto operator<=>(const TileId&) const = default;
  // The tile of a lower zoom that holds it.
  TileId at(std::uint32_t lower) const { return {lower, x >> (zoom - lower), y >> (zoom - lower)}; }
};

// Numbers by tile.
class TileLists {
 public:
  void add(std::uint32_t x, std::uint32_t y, std::uint32_t number) { added_.push_back({key(x, y), number}); }
  void finish();                                                              // before at()
  std::span<const std::uint32_t> at(std::uint32_t x, std::uint32_t y) const;  // ascending, each once
  std::size_t size() const { return numbers_.size(); }

 private:
  struct Added {
    std::uint64_t key = 0;
    std::uint32_t number = 0;
    auto operator<=>(const Added&) const = default;
  };
  static std::uint64_t key(std::uint32_t x, std::uint32_t y) { return std::uint64_t{y} << 32 | x; }

  std::vector<Added> added_;
  std::vector<std::uint64_t> keys_;
  std::vector<std::uint32_t> begin_, numbers_;
};

class TileIndex {
 public:
  explicit TileIndex(std::shared_ptr<const MapLayout> layout);

  const MapLayout& layout() const { return *layout_; }
  std::shared_ptr<const MapLayout> shared_layout() const { return layout_; }

  double tile_size(std::uint32_t zoom) const;  // metres
  // Lines are drawn to within so much: a pixel, if a tile were 1024 pixels wide. 0 from MapLayout::zooms on.
  double tolerance(std::uint32_t zoom) const;
  LayoutBox box(const TileId& tile) const;
  // Tiles of a zoom have coordinates below this.
  static std::uint32_t tiles(std::uint32_t zoom) { return std::uint32_t{1} << zoom; }

  // Whether a vertex is drawn where lines are drawn to within `tolerance`.
  bool is_drawn(std::uint32_t point, double tolerance) const {
    return layout_->points[point].importance > tolerance || tolerance == 0;
  }
  // The points at the newer ends of the drawn segments that are in the tile, and the first points of runs that are;
  // ascending. `zoom` at most MapLayout::zooms.
  std::vector<std::uint32_t> segments(const TileId& tile) const;
  // Those with an end in the tile.
  std::span<const std::uint32_t> closures(const TileId& tile) const;
  std::uint32_t run_of(std::uint32_t point) const;  // the run that a point belongs to
  std::size_t size() const;                         // numbers in all lists

 private:
  // A drawn segment that goes over more than kMostTiles tiles.
  struct Long {
    std::uint32_t from = 0, to = 0;  // points
  };
  struct Lines {
    TileLists short_ones;
    std::vector<Long> long_ones;  // ascending
  };
  void add_lines(std::uint32_t zoom, Lines& lines) const;
  void add_closures(std::uint32_t zoom, TileLists& lists) const;
  Vector2 place_of(std::uint32_t point) const { return layout_->points[point].position.head<2>() - layout_->corner; }

  std::shared_ptr<const MapLayout> layout_;
  std::vector<Lines> segments_;  // by zoom
  std::vector<TileLists> closures_;
};

// The part of a segment that lies in a box: shares of the way from a to b; false if none does.
bool clip_segment(const Vector2& a, const Vector2& b, const LayoutBox& box, double& from, double& to);

}  // namespace relmap::console
