// Selects the places of the map that are likeliest by words, to be compared feature by feature.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/place/inverted_index.h"
#include "storage/graph/graph.h"

namespace relmap::place {

inline constexpr std::size_t kShortlisted = 48;

struct ShortlistedPlace {
  FrameId frame;
  bool expected = false;    // near where the query is thought to be
  std::uint32_t group = 0;  // 0 .. groups - 1; places of a group are within kPlaceRadius steps of its likeliest
};

struct Shortlist {
  std::vector<ShortlistedPlace> places;  // likeliest first
  std::uint32_t groups = 0;
  std::size_t candidates = 0, expected = 0;  // number of such places in the whole map
};

// Returns the kShortlisted likeliest places. `expected` holds the places near which the query is thought to be, each
// once and none masked. The result does not depend on the order in which places were added.
Shortlist shortlist(const PlaceScores& scores, std::span<const std::uint32_t> expected, const storage::Graph& graph);

}  // namespace relmap::place
