// Divides a graph into two parts of about the same size with few edges between them: multilevel bisection (Karypis and
// Kumar, SIAM J. Sci. Comput. 1998), refined as Fiduccia and Mattheyses (DAC 1982) do.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

namespace relmap::route {

// Undirected, in rows: what v is joined to stands in arcs[begin[v]] .. arcs[begin[v + 1]], each neighbour once, and not
// v itself; u is a neighbour of v with the weight that v is one of u with.
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

// From pairs, of which each may be given several times, in either order: their weights are added.
struct WeightedPair {
  std::uint32_t a, b;
  std::uint32_t weight;
};
WeightedGraph make_weighted_graph(std::vector<std::uint32_t> sizes, std::vector<WeightedPair> pairs);

// The side of each node, 0 or 1. Neither side is larger than `max_share` (0.5 .. 1) of the whole, but by what one node
// takes; neither is empty where there are two nodes. The same graph gives the same sides.
std::vector<std::uint8_t> bisect(const WeightedGraph& graph, double max_share = 0.6);

std::uint64_t cut_of(const WeightedGraph& graph, const std::vector<std::uint8_t>& side);

}  // namespace relmap::route
