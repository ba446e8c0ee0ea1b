// Part of the map as a search sees it that only wants to pass: the frames at which the part can be entered or left, the
// edges that lead out, and what it costs to get from one of these frames to another within the part. Delling, Goldberg,
// Pajor and Werneck, "Customizable route planning", SEA 2011.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "server/route/overlay/cost_matrix.h"
#include "server/route/weight.h"
#include "storage/chunk.h"
#include "storage/graph.h"

namespace relmap {

// An edge of the graph, from one of its ends.
struct Link {
  FrameId to;
  EdgeId edge;
  EdgeCosts costs;
  std::uint32_t support = 0;
  bool loop = false;     // a loop edge
  bool forward = false;  // `to` is Edge::b
  bool out = false;      // it may be travelled to `to`,
  bool in = false;       // and from there

  bool long_loop() const { return loop && costs.metres > kLongLoopMetres; }
  bool operator==(const Link&) const = default;
};

struct Cell {
  std::vector<FrameId> nodes;        // ascending
  std::vector<std::uint32_t> begin;  // links of nodes[i]: links[begin[i]] .. links[begin[i + 1]]
  std::vector<Link> links;
  // Between the nodes, from row to column, one for each metric; none: each link is walked by itself.
  std::vector<CostMatrix> within;
  std::vector<CostMatrix> backwards;  // from column to row; none: as `within`
  bool oneway = false;                // not all of it may be travelled both ways
  // Of the edges between two of its frames: what a filter (passage.h) may refuse.
  std::uint32_t least_support = std::numeric_limits<std::uint32_t>::max();
  double longest_loop_m = 0;

  static constexpr std::uint32_t kNone = ~0u;
  std::uint32_t find(FrameId frame) const;  // its place among the nodes, or kNone
  // Into the node from each (backward), or from it to each.
  const double* passages(std::size_t metric, std::uint32_t node, bool backward) const {
    return (backward && !backwards.empty() ? backwards : within)[metric].row(node);
  }
  std::span<const Link> links_of(std::uint32_t node) const {
    return std::span(links).subspan(begin[node], begin[node + 1] - begin[node]);
  }
  std::size_t memory_bytes() const;
  void take_in(const Link& inner) {
    least_support = std::min(least_support, inner.support);
    if (inner.loop) longest_loop_m = std::max(longest_loop_m, inner.costs.metres);
  }
  // To a search the same: nodes, links and costs.
  bool same_passage(const Cell& other) const;
};

// Where links of one cell lead that the other does not have just so: both are a cell's of the same frames, then and
// now.
std::vector<FrameId> ends_of_changed_links(const Cell& then, const Cell& now);

// The chunk opened: all its frames and their edges. `passage`: what make_cell() makes of it, if that is known; then no
// other chunk is read. Throws StatusError where reads of the graph do.
Cell frames_of(const Graph& graph, ChunkId chunk, const Cell* passage = nullptr);

// A chunk, of what frames_of() gives.
Cell make_cell(const Cell& frames, ChunkId chunk, std::span<const RouteWeights> metrics);

// Of cells that lie beside each other.
Cell join(std::span<const Cell* const> cells, std::span<const RouteWeights> metrics);

}  // namespace relmap
