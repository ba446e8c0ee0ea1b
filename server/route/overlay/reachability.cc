#include "server/route/overlay/reachability.h"

#include <algorithm>
#include <numeric>
#include <unordered_map>
#include <unordered_set>

#include "server/route/overlay/stale.h"

namespace relmap {
namespace {

// Sets that grow together (Tarjan 1975), of numbers 0 .. n - 1.
class DisjointSets {
 public:
  explicit DisjointSets(std::uint32_t n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), 0u); }
  std::uint32_t find(std::uint32_t x) {
    while (parent_[x] != x) x = parent_[x] = parent_[parent_[x]];
    return x;
  }
  void join(std::uint32_t x, std::uint32_t y) { parent_[find(x)] = find(y); }

 private:
  std::vector<std::uint32_t> parent_;
};

}  // namespace

Reachability::Reachability(const Overlay& overlay, const Graph& graph, std::span<const ChunkId> stale,
                           std::span<const FrameId> from, std::span<const FrameId> to, const WorkLimit& work) {
  const CellTree& tree = overlay.tree();
  // Chunks of which all frames are looked at: those of the ends, and where the cells are not those of the map.
  std::unordered_map<ChunkId, Cell> opened = frames_of_stale(overlay, graph, stale, work);
  for (const auto& ends : {from, to})
    for (const FrameId frame : ends)
      if (!opened.contains(chunk_id(frame))) opened.emplace(chunk_id(frame), frames_of(graph, chunk_id(frame)));

  struct Chunk {
    ChunkId id;
    const Cell* cell;
    std::uint32_t first = 0;  // number of its first node
  };
  std::vector<Chunk> chunks;
  std::unordered_map<ChunkId, std::uint32_t> places;
  std::uint32_t nodes = 0;
  const auto take = [&](ChunkId id, const Cell& cell) {
    places.emplace(id, static_cast<std::uint32_t>(chunks.size()));
    chunks.push_back({id, &cell, nodes});
    nodes += static_cast<std::uint32_t>(cell.nodes.size());
  };
  for (const auto& [id, cell] : opened) take(id, cell);
  for (SessionNumber session = 0; session < tree.sessions(); ++session)
    for (const std::uint32_t chunk : tree.chunks_of(session))
      if (!opened.contains(tree.node(chunk).chunk)) take(tree.node(chunk).chunk, *overlay.cell(chunk));
  const auto node_of = [&](FrameId frame) {
    const auto place = places.find(chunk_id(frame));
    if (place == places.end()) return Cell::kNone;
    const Chunk& chunk = chunks[place->second];
    const std::uint32_t node = chunk.cell->find(frame);
    return node == Cell::kNone ? Cell::kNone : chunk.first + node;
  };

  DisjointSets joined(nodes);
  for (std::size_t c = 0; c < chunks.size(); ++c) {
    if (c % kWorkStride == 0 && work.proceed)
      if (Status status = work.proceed(nodes * sizeof(std::uint32_t) + chunks.size() * 2 * sizeof(Chunk)); !status.ok())
        throw StatusError(status);
    const Chunk& chunk = chunks[c];
    const Cell& cell = *chunk.cell;
    for (std::uint32_t i = 0; i < cell.nodes.size(); ++i) {
      if (!cell.within.empty())
        for (std::uint32_t j = 0; j < cell.nodes.size(); ++j)
          if (cell.within[0](i, j) < kUnreachable) joined.join(chunk.first + i, chunk.first + j);
      for (const Link& link : cell.links_of(i))
        // What the overlay says of an edge to a chunk that was opened may be out of date.
        if (cell.within.empty() || !opened.contains(chunk_id(link.to)))
          if (const std::uint32_t end = node_of(link.to); end != Cell::kNone) joined.join(chunk.first + i, end);
    }
  }

  std::unordered_set<std::uint32_t> reached;
  for (const FrameId frame : from)
    if (const std::uint32_t node = node_of(frame); node != Cell::kNone) reached.insert(joined.find(node));
  for (const FrameId frame : to) {
    const std::uint32_t node = node_of(frame);
    goal_ |= node != Cell::kNone && reached.contains(joined.find(node));
  }
  for (const Chunk& chunk : chunks)
    for (std::uint32_t i = 0; i < chunk.cell->nodes.size() && !sessions_.contains(chunk.id.session); ++i)
      if (reached.contains(joined.find(chunk.first + i))) sessions_.insert(chunk.id.session);
}

}  // namespace relmap
