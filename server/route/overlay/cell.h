// A cell stands for a part of the map in searches that pass through it. It holds its border frames, at which it can be
// entered or left, the edges that lead out of it, and the costs of the cheapest paths between border frames within it
// (Delling, Goldberg, Pajor and Werneck, "Customizable route planning", SEA 2011).
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "server/route/overlay/cost_matrix.h"
#include "server/route/weight.h"
#include "storage/graph/chunk.h"
#include "storage/graph/graph.h"

namespace relmap::route {

// An edge of the graph, from one of its ends.
struct Link {
  FrameId to;
  double metres = 0, variance_m2 = 0;
  float driven_s = 0, standing_s = 0;
  std::uint32_t ordinal = 0;  // of EdgeId
  std::uint32_t support = 0;
  bool loop = false;     // a loop edge
  bool forward = false;  // `to` is Edge::b
  bool out = false;      // the edge may be travelled to `to`
  bool in = false;       // the edge may be travelled from `to`

  // Where a search last found `to`: the number of a cell and a node of it, packed. It may be outdated, so its user must
  // check it.
  class Hint {
   public:
    Hint() = default;
    Hint(const Hint& other) : packed_(other.get()) {}
    Hint& operator=(const Hint& other) {
      set(other.get());
      return *this;
    }
    std::uint64_t get() const { return packed_.load(std::memory_order_relaxed); }
    void set(std::uint64_t packed) const { packed_.store(packed, std::memory_order_relaxed); }
    bool operator==(const Hint&) const { return true; }

   private:
    mutable std::atomic<std::uint64_t> packed_ = ~std::uint64_t{0};
  } met_at = {};

  EdgeId edge(FrameId from) const { return {forward ? to : from, ordinal}; }
  EdgeCosts costs() const { return {metres, double{driven_s}, double{standing_s}, variance_m2}; }
  bool long_loop() const { return loop && metres > kLongLoopMetres; }
  bool operator==(const Link&) const = default;
};

// Frames of a part of the map and their edges: the border frames with the edges that lead out, or all frames with all
// edges.
struct CellFrames {
  std::vector<FrameId> nodes;        // ascending
  std::vector<std::uint32_t> begin;  // links of nodes[i]: links[begin[i]] .. links[begin[i + 1]]
  std::vector<Link> links;

  static constexpr std::uint32_t kNone = ~0u;
  std::uint32_t find(FrameId frame) const;  // index among the nodes, or kNone
  std::span<const Link> links_of(std::uint32_t node) const {
    return std::span(links).subspan(begin[node], begin[node + 1] - begin[node]);
  }
  std::size_t memory_bytes() const;
  bool operator==(const CellFrames&) const = default;
};

// Facts about a cell that are known without reading it.
struct CellFacts {
  bool oneway = false;  // whether some of its edges may be travelled in one direction only
  // Whether its edges, whatever their directions, connect all of its frames; parts into which no edge leads do not
  // count.
  bool joined = false;
  // Extremes over the edges between two of its frames, which a filter (passage.h) may refuse.
  std::uint32_t min_support = std::numeric_limits<std::uint32_t>::max();
  double max_loop_m = 0;

  void take_in(const Link& inner) {
    min_support = std::min(min_support, inner.support);
    if (inner.loop) max_loop_m = std::max(max_loop_m, inner.metres);
  }
  void take_in(const CellFacts& part) {
    oneway |= part.oneway;
    min_support = std::min(min_support, part.min_support);
    max_loop_m = std::max(max_loop_m, part.max_loop_m);
  }
  bool operator==(const CellFacts&) const = default;
};

struct Cell {
  CellFacts facts;
  CellFrames frames;
  std::vector<CostMatrix> within;  // for each metric, the costs from border frame (row) to border frame (column)
};

// The ends of links that differ between two states of a chunk, of those that only one of the two has.
std::vector<FrameId> ends_of_changed_links(const CellFrames& then, const CellFrames& now);

// Returns all frames of a chunk and their edges. If the border frames of the chunk's cell are given, no other chunk is
// read. Throws StatusError where reads of the graph do.
CellFrames frames_of(const storage::Graph& graph, storage::ChunkId chunk, const CellFrames* border = nullptr);

// Makes the cell of a chunk from the result of frames_of().
Cell make_cell(const CellFrames& frames, storage::ChunkId chunk, std::span<const RouteWeights> metrics);

}  // namespace relmap::route
