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
  std::unordered_map<ChunkId, CellFrames> opened = frames_of_stale(overlay, graph, stale, work);
  for (const auto& ends : {from, to})
    for (const FrameId frame : ends)
      if (!opened.contains(chunk_id(frame))) opened.emplace(chunk_id(frame), frames_of(graph, chunk_id(frame)));

  // Nodes of all chunks, one after the other.
  struct Chunk {
    ChunkId id;
    const StoredCell* cell;  // null: it is opened
    std::uint32_t first;
  };
  std::vector<Chunk> chunks;
  std::unordered_map<ChunkId, std::uint32_t> places;
  std::vector<FrameId> nodes;
  const auto check = [&] {
    if (chunks.size() % kWorkStride != 0 || !work.proceed) return;
    const std::size_t bytes = nodes.size() * 12 + chunks.size() * 80;
    if (Status status = work.proceed(bytes); !status.ok()) throw StatusError(status);
  };
  const auto take = [&](ChunkId id, const StoredCell* cell, const CellFrames& frames) {
    check();
    places.emplace(id, static_cast<std::uint32_t>(chunks.size()));
    chunks.push_back({id, cell, static_cast<std::uint32_t>(nodes.size())});
    nodes.insert(nodes.end(), frames.nodes.begin(), frames.nodes.end());
  };
  for (const auto& [id, frames] : opened) take(id, nullptr, frames);
  for (SessionNumber session = 0; session < tree.sessions(); ++session)
    for (const std::uint32_t chunk : tree.chunks_of(session))
      if (const StoredCell* cell = overlay.cell(chunk); !opened.contains(tree.node(chunk).chunk))
        take(tree.node(chunk).chunk, cell, cell->read_frames());
  const auto end_of = [&](std::size_t chunk) {
    return chunk + 1 < chunks.size() ? chunks[chunk + 1].first : static_cast<std::uint32_t>(nodes.size());
  };
  const auto node_of = [&](FrameId frame) {
    const auto place = places.find(chunk_id(frame));
    if (place == places.end()) return CellFrames::kNone;
    const auto end = nodes.begin() + end_of(place->second);
    const auto node = std::lower_bound(nodes.begin() + chunks[place->second].first, end, frame);
    return node == end || *node != frame ? CellFrames::kNone : static_cast<std::uint32_t>(node - nodes.begin());
  };

  DisjointSets joined(static_cast<std::uint32_t>(nodes.size()));
  for (const auto& [id, cell, first] : chunks) {
    check();
    const CellFrames stored = cell ? cell->read_frames() : CellFrames();
    const CostMatrix within = cell ? cell->read_within(0) : CostMatrix();
    const CellFrames& frames = cell ? stored : opened.at(id);
    for (std::uint32_t i = 0; i < frames.nodes.size(); ++i) {
      if (cell)
        for (std::uint32_t j = 0; j < frames.nodes.size(); ++j)
          if (within(i, j) < kUnreachable) joined.join(first + i, first + j);
      for (const Link& link : frames.links_of(i))
        // What the overlay says of an edge to a chunk that was opened may be out of date.
        if (!cell || !opened.contains(chunk_id(link.to)))
          if (const std::uint32_t end = node_of(link.to); end != CellFrames::kNone) joined.join(first + i, end);
    }
  }

  std::unordered_set<std::uint32_t> reached;
  for (const FrameId frame : from)
    if (const std::uint32_t node = node_of(frame); node != CellFrames::kNone) reached.insert(joined.find(node));
  for (const FrameId frame : to) {
    const std::uint32_t node = node_of(frame);
    goal_ |= node != CellFrames::kNone && reached.contains(joined.find(node));
  }
  for (std::uint32_t node = 0; node < nodes.size(); ++node)
    if (reached.contains(joined.find(node))) sessions_.insert(nodes[node].session);
}

}  // namespace relmap
