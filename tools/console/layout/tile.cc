#include "tools/console/layout/tile.h"

#include "proto/base/bytes.h"

namespace relmap::console {
namespace {

// Arrays begin at multiples of four bytes.
void align(ByteWriter& out) {
  while (out.size() % 4 != 0) out.put(std::uint8_t{0});
}

template <typename Items, typename Member>
void put_column(ByteWriter& out, const Items& items, Member member) {
  for (const auto& item : items) out.put(member(item));
  align(out);
}

}  // namespace

std::string Tile::encoded() const {
  ByteWriter out;
  out.reserve(64 + 12 * runs.size() + 26 * vertices.size() + 64 * closures.size());
  for (const std::size_t number :
       {std::size_t{kMagic}, runs.size(), vertices.size(), closures.size(), std::size_t{flags}, std::size_t{0}})
    out.put(static_cast<std::uint32_t>(number));
  out.put(origin_x);
  out.put(origin_y);
  out.put(unit);
  out.put(std::uint32_t{0});
  put_column(out, runs, [](const Run& run) { return run.session; });
  put_column(out, runs, [](const Run& run) { return run.first; });
  put_column(out, runs, [](const Run& run) { return run.part; });
  put_column(out, vertices, [](const Vertex& v) { return v.x; });
  put_column(out, vertices, [](const Vertex& v) { return v.y; });
  put_column(out, vertices, [](const Vertex& v) { return v.index; });
  put_column(out, vertices, [](const Vertex& v) { return v.time_s; });
  put_column(out, vertices, [](const Vertex& v) { return v.flags; });
  if (flags & kHasOld) {
    put_column(out, vertices, [](const Vertex& v) { return v.old_x; });
    put_column(out, vertices, [](const Vertex& v) { return v.old_y; });
  }
  if (flags & kHasSigmas) put_column(out, vertices, [](const Vertex& v) { return v.sigma; });
  put_column(out, closures, [](const Closure& c) { return c.a_x; });
  put_column(out, closures, [](const Closure& c) { return c.a_y; });
  put_column(out, closures, [](const Closure& c) { return c.b_x; });
  put_column(out, closures, [](const Closure& c) { return c.b_y; });
  put_column(out, closures, [](const Closure& c) { return c.id.frame.session; });
  put_column(out, closures, [](const Closure& c) { return c.id.frame.index; });
  put_column(out, closures, [](const Closure& c) { return c.id.ordinal; });
  put_column(out, closures, [](const Closure& c) { return c.a.session; });
  put_column(out, closures, [](const Closure& c) { return c.a.index; });
  put_column(out, closures, [](const Closure& c) { return c.time_s; });
  put_column(out, closures, [](const Closure& c) { return c.alike; });
  put_column(out, closures, [](const Closure& c) { return c.suspicion; });
  put_column(out, closures, [](const Closure& c) { return c.sigmas; });
  put_column(out, closures, [](const Closure& c) { return c.state; });
  put_column(out, closures, [](const Closure& c) { return c.flags; });
  if (flags & kHasOld) {
    put_column(out, closures, [](const Closure& c) { return c.old_a_x; });
    put_column(out, closures, [](const Closure& c) { return c.old_a_y; });
    put_column(out, closures, [](const Closure& c) { return c.old_b_x; });
    put_column(out, closures, [](const Closure& c) { return c.old_b_y; });
  }
  const Bytes& bytes = out.bytes();
  return {bytes.begin(), bytes.end()};
}

}  // namespace relmap::console
