#include "server/route/overlay/cell_tree.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace relmap {
namespace {

constexpr double kFanout = 8;  // about

}  // namespace

// Chunks, as nodes of the tree, and what joins them.
struct CellTree::Part {
  std::vector<std::uint32_t> chunks;
  WeightedGraph graph;
};

CellTree::CellTree(std::span<const ChunkId> chunks, std::vector<WeightedPair> ties) {
  Part all;
  for (const ChunkId chunk : chunks) {
    const auto number = static_cast<std::uint32_t>(nodes_.size());
    if (sessions_.size() <= chunk.session) sessions_.resize(chunk.session + std::size_t{1});
    SessionChunks& session = sessions_[chunk.session];
    if (session.chunks.empty()) session.number = number;
    session.chunks.push_back(chunk.chunk);
    nodes_.push_back({kNone, 0, chunk, {}});
    all.chunks.push_back(number);
  }
  all.graph = make_weighted_graph(std::vector<std::uint32_t>(chunks.size(), 1), std::move(ties));
  const double count = std::max<double>(2, static_cast<double>(chunks.size()));
  const double levels = std::max(1.0, std::round(std::log(count) / std::log(kFanout)));
  fanout_ = std::pow(count, 1 / levels);
  make(std::move(all), static_cast<std::uint32_t>(levels));
  for (std::uint32_t cell = 0; cell < chunks.size(); ++cell)
    for (std::uint32_t up = cell; up != root(); up = nodes_[up].parent) paths_.push_back(up);
}

std::uint32_t CellTree::find(ChunkId chunk) const {
  if (chunk.session >= sessions_.size() || sessions_[chunk.session].chunks.empty()) return kNone;
  const auto& [number, chunks] = sessions_[chunk.session];
  // Mostly none is missing between them.
  const std::uint32_t place = chunk.chunk - chunks.front();
  if (place < chunks.size() && chunks[place] == chunk.chunk) return number + place;
  const auto found = std::lower_bound(chunks.begin(), chunks.end(), chunk.chunk);
  return found == chunks.end() || *found != chunk.chunk ? kNone
                                                        : number + static_cast<std::uint32_t>(found - chunks.begin());
}

std::uint32_t CellTree::make(Part part, std::uint32_t level) {
  std::vector<std::uint32_t> children;
  if (level == 1)
    children = std::move(part.chunks);
  else
    divide(std::move(part), level - 1, children);
  const auto cell = static_cast<std::uint32_t>(nodes_.size());
  for (const std::uint32_t child : children) nodes_[child].parent = cell;
  nodes_.push_back({kNone, level, {}, std::move(children)});
  return cell;
}

void CellTree::divide(Part part, std::uint32_t level, std::vector<std::uint32_t>& cells) {
  if (static_cast<double>(part.chunks.size()) <= std::pow(fanout_, level) * (1 + 1e-9)) {
    cells.push_back(make(std::move(part), level));
    return;
  }
  const std::vector<std::uint8_t> side = bisect(part.graph);
  Part halves[2];
  {
    std::vector<std::uint32_t> place(part.chunks.size());
    for (std::uint32_t v = 0; v < part.chunks.size(); ++v) {
      place[v] = static_cast<std::uint32_t>(halves[side[v]].chunks.size());
      halves[side[v]].chunks.push_back(part.chunks[v]);
    }
    std::vector<WeightedPair> ties[2];
    for (std::uint32_t v = 0; v < part.chunks.size(); ++v)
      for (std::uint32_t i = part.graph.begin[v]; i < part.graph.begin[v + 1]; ++i)
        if (const auto [u, weight] = part.graph.arcs[i]; v < u && side[v] == side[u])
          ties[side[v]].push_back({place[v], place[u], weight});
    for (int half = 0; half < 2; ++half)
      halves[half].graph =
          make_weighted_graph(std::vector<std::uint32_t>(halves[half].chunks.size(), 1), std::move(ties[half]));
    part = {};
  }
  divide(std::move(halves[0]), level, cells);
  divide(std::move(halves[1]), level, cells);
}

}  // namespace relmap
