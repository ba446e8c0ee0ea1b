// The places of the map that words make likeliest: those that are worth being compared feature by feature.
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
  std::uint32_t group = 0;  // of places within kPlaceRadius steps: 0 .. groups - 1
};

struct Shortlist {
  std::vector<ShortlistedPlace> places;  // the likeliest first
  std::uint32_t groups = 0;
  std::size_t candidates = 0, expected = 0;  // of the whole map
};

// A function of what the places are, not of where they stand. `expected`: each once, none left out.
Shortlist shortlist(const PlaceScores& scores, std::span<const std::uint32_t> expected, const storage::Graph& graph);

}  // namespace relmap::place
