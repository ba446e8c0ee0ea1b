// Divides a graph into two parts of about the same size with few edges between them, by multilevel bisection (Karypis
// and Kumar, SIAM J. Sci. Comput. 1998) with the refinement of Fiduccia and Mattheyses (DAC 1982).
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

namespace relmap::route {

// An undirected graph in compressed rows: the neighbours of v are in arcs[begin[v]] .. arcs[begin[v + 1]], each once
// and without v itself. Arcs are symmetric: v is a neighbour of u with the weight with which u is one of v.
struct WeightedGraph {
  struct Arc {
    std::uint32_t to;
    std::uint32_t weight;
  };
  std::vector<std::uint32_t> size;  // of each node, above 0
  std::vector<std::uint32_t> begin{0};
  std::vector<Arc> arcs;

  std::uint32_t nodes() const { return static_cast<std::uint32_t>(size.size()); }
};

// A pair of nodes that are joined.
struct WeightedPair {
  std::uint32_t a, b;
  std::uint32_t weight;
};
// A pair may be given several times, in either order; its weights are added.
WeightedGraph make_weighted_graph(std::vector<std::uint32_t> sizes, std::vector<WeightedPair> pairs);

// Returns the side of each node, 0 or 1. Neither side exceeds the share `max_share` (0.5 .. 1) of the whole by more
// than the size of one node, and neither is empty if there are at least two nodes. Deterministic.
std::vector<std::uint8_t> bisect(const WeightedGraph& graph, double max_share = 0.6);

// The total weight of the arcs between the two sides.
std::uint64_t cut_of(const WeightedGraph& graph, const std::vector<std::uint8_t>& side);

}  // namespace relmap::route
