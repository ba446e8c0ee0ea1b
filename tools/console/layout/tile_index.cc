#include "tools/console/layout/tile_index.h"

#include <algorithm>
#include <cmath>

namespace relmap::console {
namespace {

constexpr double kPixels = 1024;  // of a tile, where lines are simplified
// A segment over more columns and rows is listed once for all tiles.
constexpr std::uint32_t kMostTiles = 64;
constexpr double kEdge = 1e-3;  // of a tile

// The columns or rows of places, which are relative to the layout's corner.
struct Cells {
  Cells(double tile_size, std::uint32_t tiles) : side(tile_size), last(static_cast<double>(tiles - 1)) {}

  std::uint32_t operator()(double metres) const {
    return static_cast<std::uint32_t>(std::clamp(std::floor(metres / side), 0.0, last));
  }
  const double side, last;
};

}  // namespace

void TileLists::finish() {
  std::sort(added_.begin(), added_.end());
  added_.erase(std::unique(added_.begin(), added_.end()), added_.end());
  numbers_.reserve(added_.size());
  for (const Added& added : added_) {
    if (keys_.empty() || keys_.back() != added.key) {
      keys_.push_back(added.key);
      begin_.push_back(static_cast<std::uint32_t>(numbers_.size()));
    }
    numbers_.push_back(added.number);
  }
  begin_.push_back(static_cast<std::uint32_t>(numbers_.size()));
  keys_.shrink_to_fit();
  begin_.shrink_to_fit();
  added_ = {};
}

std::span<const std::uint32_t> TileLists::at(std::uint32_t x, std::uint32_t y) const {
  const auto found = std::lower_bound(keys_.begin(), keys_.end(), key(x, y));
  if (found == keys_.end() || *found != key(x, y)) return {};
  const auto k = static_cast<std::size_t>(found - keys_.begin());
  return std::span(numbers_).subspan(begin_[k], begin_[k + 1] - begin_[k]);
}

bool clip_segment(const Vector2& a, const Vector2& b, const LayoutBox& box, double& from, double& to) {
  from = 0;
  to = 1;
  const Vector2 along = b - a;
  for (int i = 0; i < 2; ++i) {
    if (along[i] == 0) {
      if (a[i] < box.low[i] || a[i] > box.high[i]) return false;
      continue;
    }
    double enter = (box.low[i] - a[i]) / along[i], leave = (box.high[i] - a[i]) / along[i];
    if (enter > leave) std::swap(enter, leave);
    from = std::max(from, enter);
    to = std::min(to, leave);
  }
  return from <= to;
}

TileIndex::TileIndex(std::shared_ptr<const MapLayout> layout) : layout_(std::move(layout)) {
  segments_.resize(layout_->zooms + 1);
  closures_.resize(layout_->zooms + 1);
  for (std::uint32_t zoom = 0; zoom <= layout_->zooms; ++zoom) {
    add_lines(zoom, segments_[zoom]);
    segments_[zoom].short_ones.finish();
    add_closures(zoom, closures_[zoom]);
    closures_[zoom].finish();
  }
}

double TileIndex::tile_size(std::uint32_t zoom) const { return std::ldexp(layout_->size, -static_cast<int>(zoom)); }

double TileIndex::tolerance(std::uint32_t zoom) const { return zoom >= layout_->zooms ? 0 : tile_size(zoom) / kPixels; }

LayoutBox TileIndex::box(const TileId& tile) const {
  const double side = tile_size(tile.zoom);
  const Vector2 low = layout_->corner + side * Vector2(tile.x, tile.y);
  return {low, low + Vector2::Constant(side)};
}

void TileIndex::add_lines(std::uint32_t zoom, Lines& lines) const {
  const double side = tile_size(zoom), off = tolerance(zoom);
  TileLists& lists = lines.short_ones;
  const Cells tile_of(side, tiles(zoom));
  for (const MapLayout::Run& run : layout_->runs) {
    std::uint32_t from_point = run.first;
    for (std::uint32_t k = run.first; k < run.end; ++k) {
      if (!is_drawn(k, off)) continue;
      const Vector2 before = place_of(from_point), at = place_of(k);
      const std::uint32_t x0 = tile_of(std::min(before.x(), at.x())), x1 = tile_of(std::max(before.x(), at.x()));
      const std::uint32_t y0 = tile_of(std::min(before.y(), at.y())), y1 = tile_of(std::max(before.y(), at.y()));
      if (x1 - x0 + y1 - y0 >= kMostTiles) {
        lines.long_ones.push_back({from_point, k});
      } else if (x0 == x1 || y0 == y1) {
        for (std::uint32_t x = x0; x <= x1; ++x)
          for (std::uint32_t y = y0; y <= y1; ++y) lists.add(x, y, k);
      } else {
        lists.add(tile_of(before.x()), tile_of(before.y()), k);  // which rounding could miss
        lists.add(tile_of(at.x()), tile_of(at.y()), k);
        // Column by column, the tiles between where the segment enters and leaves it.
        for (std::uint32_t x = x0; x <= x1; ++x) {
          const LayoutBox column{{x * side, std::min(before.y(), at.y())},
                                 {(x + 1) * side, std::max(before.y(), at.y())}};
          double from = 0, to = 1;
          if (!clip_segment(before, at, column, from, to)) continue;
          const double enters = before.y() + from * (at.y() - before.y());
          const double leaves = before.y() + to * (at.y() - before.y());
          for (std::uint32_t y = tile_of(std::min(enters, leaves)); y <= tile_of(std::max(enters, leaves)); ++y)
            lists.add(x, y, k);
        }
      }
      from_point = k;
    }
  }
}

void TileIndex::add_closures(std::uint32_t zoom, TileLists& lists) const {
  const Cells tile_of(tile_size(zoom), tiles(zoom));
  for (std::size_t c = 0; c < layout_->closures.size(); ++c) {
    const MapLayout::Closure& closure = layout_->closures[c];
    for (const std::uint32_t end : {closure.at_a, closure.at_b}) {
      const Vector2 at = place_of(end);
      lists.add(tile_of(at.x()), tile_of(at.y()), static_cast<std::uint32_t>(c));
    }
  }
}

std::vector<std::uint32_t> TileIndex::segments(const TileId& tile) const {
  const Lines& lines = segments_[tile.zoom];
  const std::span<const std::uint32_t> found = lines.short_ones.at(tile.x, tile.y);
  std::vector<std::uint32_t> all(found.begin(), found.end());
  // A little more than the tile, for what rounding could miss.
  const double side = tile_size(tile.zoom);
  const Vector2 low = side * Vector2(tile.x, tile.y), edge = Vector2::Constant(kEdge * side);
  const LayoutBox box{low - edge, low + Vector2::Constant(side) + edge};
  for (const Long& one : lines.long_ones) {
    double from = 0, to = 1;
    if (clip_segment(place_of(one.from), place_of(one.to), box, from, to)) all.push_back(one.to);
  }
  std::inplace_merge(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(found.size()), all.end());
  return all;
}

std::span<const std::uint32_t> TileIndex::closures(const TileId& tile) const {
  return closures_[tile.zoom].at(tile.x, tile.y);
}

std::size_t TileIndex::size() const {
  std::size_t all = 0;
  for (const Lines& lines : segments_) all += lines.short_ones.size() + lines.long_ones.size();
  for (const TileLists& lists : closures_) all += lists.size();
  return all;
}

std::uint32_t TileIndex::run_of(std::uint32_t point) const {
  const auto after = std::upper_bound(layout_->runs.begin(), layout_->runs.end(), point,
                                      [](std::uint32_t k, const MapLayout::Run& run) { return k < run.first; });
  return static_cast<std::uint32_t>(std::prev(after) - layout_->runs.begin());
}

}  // namespace relmap::console
