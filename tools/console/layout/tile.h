// A piece of the layout as the page draws it, and its bytes. tools/console/README.md describes them.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "client/map_types.h"

namespace relmap::console {

struct Tile {
  static constexpr std::uint32_t kMagic = 0x31544d52;  // "RMT1"
  static constexpr std::uint32_t kHasOld = 1, kHasSigmas = 2;
  static constexpr std::uint8_t kIsEdge = 1, kIsTorn = 2;  // flags of closures

  std::uint32_t flags = 0;
  double origin_x = 0, origin_y = 0;  // metres
  float unit = 1;                     // metres

  struct Run {
    std::uint32_t session = 0, first = 0, part = 0;  // `first`: its first vertex
    bool operator==(const Run&) const = default;
  };
  struct Vertex {
    std::uint16_t x = 0, y = 0;           // units from the origin
    std::uint32_t index = 0, time_s = 0;  // of the frame
    std::uint8_t flags = 0;               // PointFlag
    float old_x = 0, old_y = 0;           // metres from the origin
    float sigma = 0;                      // metres
    bool operator==(const Vertex&) const = default;
  };
  struct Closure {
    float a_x = 0, a_y = 0, b_x = 0, b_y = 0;  // metres from the origin
    EdgeId id;
    FrameId a;
    std::uint32_t time_s = 0, alike = 1;
    float suspicion = 0, sigmas = 0;
    std::uint8_t state = 0, flags = 0;
    float old_a_x = 0, old_a_y = 0, old_b_x = 0, old_b_y = 0;
    bool operator==(const Closure&) const = default;
  };
  std::vector<Run> runs;
  std::vector<Vertex> vertices;
  std::vector<Closure> closures;

  bool empty() const { return vertices.empty() && closures.empty(); }
  std::string encoded() const;
  bool operator==(const Tile&) const = default;
};

}  // namespace relmap::console
