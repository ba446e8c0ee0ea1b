// Part of the map as a search sees it that only wants to pass: the frames at which the part can be entered or left, the
// edges that lead out, and what it costs to get from one of these frames to another within the part. Delling, Goldberg,
// Pajor and Werneck, "Customizable route planning", SEA 2011.
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
  bool out = false;      // it may be travelled to `to`,
  bool in = false;       // and from there

  // Where searches met `to` last: a cell's number and a node of it, packed; to be checked by whoever follows it.
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

// Frames at which a search meets a part of the map, and their edges: those that lead out of it, or all.
struct CellFrames {
  std::vector<FrameId> nodes;        // ascending
  std::vector<std::uint32_t> begin;  // links of nodes[i]: links[begin[i]] .. links[begin[i + 1]]
  std::vector<Link> links;

  static constexpr std::uint32_t kNone = ~0u;
  std::uint32_t find(FrameId frame) const;  // its place among the nodes, or kNone
  std::span<const Link> links_of(std::uint32_t node) const {
    return std::span(links).subspan(begin[node], begin[node + 1] - begin[node]);
  }
  std::size_t memory_bytes() const;
  bool operator==(const CellFrames&) const = default;
};

// What is asked of a cell before it is looked into.
struct CellFacts {
  bool oneway = false;  // not all of it may be travelled both ways
  // Its edges lead from each of its frames to each other, some perhaps against the traffic; frames of parts that no
  // edge leads into apart.
  bool joined = false;
  // Of the edges between two of its frames: what a filter (passage.h) may refuse.
  std::uint32_t min_support = std::numeric_limits<std::uint32_t>::max();
  double longest_loop_m = 0;

  void take_in(const Link& inner) {
    min_support = std::min(min_support, inner.support);
    if (inner.loop) longest_loop_m = std::max(longest_loop_m, inner.metres);
  }
  void take_in(const CellFacts& part) {
    oneway |= part.oneway;
    min_support = std::min(min_support, part.min_support);
    longest_loop_m = std::max(longest_loop_m, part.longest_loop_m);
  }
  bool operator==(const CellFacts&) const = default;
};

struct Cell {
  CellFacts facts;
  CellFrames frames;
  std::vector<CostMatrix> within;  // between the frames, from row to column, one for each metric
};

// Where links of one lead that the other does not have just so: both are a chunk's, then and now.
std::vector<FrameId> ends_of_changed_links(const CellFrames& then, const CellFrames& now);

// The chunk opened: all its frames and their edges. `border`: of its cell, if that is known; then no other chunk is
// read. Throws StatusError where reads of the graph do.
CellFrames frames_of(const storage::Graph& graph, storage::ChunkId chunk, const CellFrames* border = nullptr);

// A chunk, of what frames_of() gives.
Cell make_cell(const CellFrames& frames, storage::ChunkId chunk, std::span<const RouteWeights> metrics);

}  // namespace relmap::route
