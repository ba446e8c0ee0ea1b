#include "tools/console/layout/tile_lines.h"

#include <algorithm>
#include <cmath>

namespace relmap::console {
namespace {

constexpr double kUnitsOfTile = 32768;  // half of them lie beyond the tile, a quarter on each side

std::uint32_t between(std::uint32_t from, std::uint32_t to, double share) {
  const double a = from, b = to;
  return static_cast<std::uint32_t>(std::llround(a + share * (b - a)));
}

}  // namespace

std::uint16_t in_units(double metres, double origin, double unit) {
  return static_cast<std::uint16_t>(std::clamp(std::round((metres - origin) / unit), 0.0, 65535.0));
}

TileLines::TileLines(const LayoutBox& box, Tile& tile)
    : box_(box), beyond_{box.low - box.size() / 2, box.high + box.size() / 2}, tile_(tile) {
  tile_.origin_x = beyond_.low.x();
  tile_.origin_y = beyond_.low.y();
  tile_.unit = static_cast<float>(box.size().x() / kUnitsOfTile);
}

void TileLines::begin(SessionNumber session, std::uint32_t part) {
  run_ = {session, 0, part};
  any_ = drawn_ = open_ = false;
}

void TileLines::add(const LineVertex& vertex) {
  if (any_) {
    double from = 0, to = 1;
    if (clip_segment(before_.at, vertex.at, box_, from, to)) {
      clip_segment(before_.at, vertex.at, beyond_, from, to);
      if (!open_) {
        run_.first = static_cast<std::uint32_t>(tile_.vertices.size());
        tile_.runs.push_back(run_);
        if (from > 0) {
          emit_cut(before_, vertex, from);
        } else {
          LineVertex first = before_;
          first.flags &= kSessionEnd;  // its step is not in the tile
          emit(first);
        }
      }
      open_ = to >= 1;
      if (open_) {
        emit(vertex);
      } else {
        emit_cut(before_, vertex, to);
        tile_.vertices.back().flags |= vertex.flags & (kUnmeasured | kCarried);
      }
      drawn_ = true;
    } else {
      open_ = false;
    }
  }
  before_ = vertex;
  any_ = true;
}

void TileLines::end() {
  const bool inside = (before_.at.array() >= box_.low.array()).all() && (before_.at.array() <= box_.high.array()).all();
  if (!any_ || drawn_ || !inside) return;
  run_.first = static_cast<std::uint32_t>(tile_.vertices.size());  // a line of one frame
  tile_.runs.push_back(run_);
  emit(before_);
}

void TileLines::emit(const LineVertex& vertex) {
  Tile::Vertex& v = tile_.vertices.emplace_back();
  v.x = in_units(vertex.at.x(), tile_.origin_x, tile_.unit);
  v.y = in_units(vertex.at.y(), tile_.origin_y, tile_.unit);
  v.index = vertex.index;
  v.time_s = vertex.time_s;
  v.flags = vertex.flags & (kUnmeasured | kCarried | kCut | kSessionEnd);
  if (tile_.flags & Tile::kHasOld) {
    v.old_x = static_cast<float>(vertex.old.x() - tile_.origin_x);
    v.old_y = static_cast<float>(vertex.old.y() - tile_.origin_y);
  }
  if (tile_.flags & Tile::kHasSigmas) v.sigma = static_cast<float>(vertex.sigma);
}

void TileLines::emit_cut(const LineVertex& from, const LineVertex& to, double share) {
  LineVertex cut;
  cut.at = from.at + share * (to.at - from.at);
  cut.old = from.old + share * (to.old - from.old);
  cut.sigma = share <= 0 ? from.sigma : share >= 1 ? to.sigma : (1 - share) * from.sigma + share * to.sigma;
  cut.index = between(from.index, to.index, share);
  if (from.time_s != 0 && to.time_s != 0) cut.time_s = between(from.time_s, to.time_s, share);
  cut.flags = kCut;
  emit(cut);
}

}  // namespace relmap::console
