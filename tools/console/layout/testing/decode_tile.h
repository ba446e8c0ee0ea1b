// Reads the bytes of a tile, as the page does.
#pragma once

#include <optional>
#include <string>

#include "proto/base/bytes.h"
#include "tools/console/layout/tile.h"

namespace relmap::console::testing {

class TileDecoder {
 public:
  explicit TileDecoder(const std::string& bytes) : in_(as_bytes(bytes)) {}

  // Nothing: the bytes are no tile.
  std::optional<Tile> decode() {
    Tile tile;
    if (in_.get<std::uint32_t>() != Tile::kMagic) return {};
    const auto runs = in_.get<std::uint32_t>(), vertices = in_.get<std::uint32_t>(),
               closures = in_.get<std::uint32_t>();
    tile.flags = in_.get<std::uint32_t>();
    if (in_.get<std::uint32_t>() != 0) return {};
    tile.origin_x = in_.get<double>();
    tile.origin_y = in_.get<double>();
    tile.unit = in_.get<float>();
    if (in_.get<std::uint32_t>() != 0 || !in_.fits(runs, 12) || !in_.fits(vertices, 13) || !in_.fits(closures, 50))
      return {};
    tile.runs.resize(runs);
    tile.vertices.resize(vertices);
    tile.closures.resize(closures);
    using V = Tile::Vertex;
    using C = Tile::Closure;
    column(
        tile.runs, [](Tile::Run & r) -> auto& { return r.session; });
    column(
        tile.runs, [](Tile::Run & r) -> auto& { return r.first; });
    column(
        tile.runs, [](Tile::Run & r) -> auto& { return r.part; });
    column(
        tile.vertices, [](V & v) -> auto& { return v.x; });
    column(
        tile.vertices, [](V & v) -> auto& { return v.y; });
    column(
        tile.vertices, [](V & v) -> auto& { return v.index; });
    column(
        tile.vertices, [](V & v) -> auto& { return v.time_s; });
    column(
        tile.vertices, [](V & v) -> auto& { return v.flags; });
    if (tile.flags & Tile::kHasOld) {
      column(
          tile.vertices, [](V & v) -> auto& { return v.old_x; });
      column(
          tile.vertices, [](V & v) -> auto& { return v.old_y; });
    }
    if (tile.flags & Tile::kHasSigmas)
      column(
          tile.vertices, [](V & v) -> auto& { return v.sigma; });
    column(
        tile.closures, [](C & c) -> auto& { return c.a_x; });
    column(
        tile.closures, [](C & c) -> auto& { return c.a_y; });
    column(
        tile.closures, [](C & c) -> auto& { return c.b_x; });
    column(
        tile.closures, [](C & c) -> auto& { return c.b_y; });
    column(
        tile.closures, [](C & c) -> auto& { return c.id.frame.session; });
    column(
        tile.closures, [](C & c) -> auto& { return c.id.frame.index; });
    column(
        tile.closures, [](C & c) -> auto& { return c.id.ordinal; });
    column(
        tile.closures, [](C & c) -> auto& { return c.a.session; });
    column(
        tile.closures, [](C & c) -> auto& { return c.a.index; });
    column(
        tile.closures, [](C & c) -> auto& { return c.time_s; });
    column(
        tile.closures, [](C & c) -> auto& { return c.alike; });
    column(
        tile.closures, [](C & c) -> auto& { return c.suspicion; });
    column(
        tile.closures, [](C & c) -> auto& { return c.sigmas; });
    column(
        tile.closures, [](C & c) -> auto& { return c.state; });
    column(
        tile.closures, [](C & c) -> auto& { return c.flags; });
    if (tile.flags & Tile::kHasOld) {
      column(
          tile.closures, [](C & c) -> auto& { return c.old_a_x; });
      column(
          tile.closures, [](C & c) -> auto& { return c.old_a_y; });
      column(
          tile.closures, [](C & c) -> auto& { return c.old_b_x; });
      column(
          tile.closures, [](C & c) -> auto& { return c.old_b_y; });
    }
    if (!in_.at_end()) return {};
    return tile;
  }

 private:
  template <typename Items, typename Member>
  void column(Items& items, Member member) {
    for (auto& item : items) {
      auto& value = member(item);
      value = in_.get<std::remove_reference_t<decltype(value)>>();
    }
    while (in_.position() % 4 != 0) in_.get<std::uint8_t>();
  }

  ByteReader in_;
};

inline std::optional<Tile> decode_tile(const std::string& bytes) { return TileDecoder(bytes).decode(); }

}  // namespace relmap::console::testing
