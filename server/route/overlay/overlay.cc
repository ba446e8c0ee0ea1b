#include "server/route/overlay/overlay.h"

#include <algorithm>
#include <set>
#include <unordered_map>

namespace relmap {

void Overlay::build(const Graph& graph) {
  std::vector<ChunkId> chunks;
  std::vector<std::shared_ptr<const Cell>> cells;
  std::unordered_map<ChunkId, std::uint32_t> places;
  for (const Session& session : graph.sessions()) {
    if (session.frames == 0) continue;
    for (std::uint32_t c = session.first / kFramesPerChunk; c <= session.last / kFramesPerChunk; ++c) {
      const ChunkId chunk{session.number, c};
      const Cell frames = frames_of(graph, chunk);
      if (frames.nodes.empty()) continue;
      places.emplace(chunk, static_cast<std::uint32_t>(chunks.size()));
      chunks.push_back(chunk);
      cells.push_back(std::make_shared<const Cell>(make_cell(frames, chunk, metrics_)));
    }
  }
  std::vector<WeightedPair> ties;
  for (std::uint32_t c = 0; c < chunks.size(); ++c)
    for (const Link& link : cells[c]->links)
      if (const auto other = places.find(chunk_id(link.to)); other != places.end() && c < other->second)
        ties.push_back({c, other->second, 1});
  tree_ = CellTree(chunks, std::move(ties));
  cells_ = std::move(cells);
  for (auto cell = static_cast<std::uint32_t>(cells_.size()); cell < tree_.root(); ++cell) cells_.push_back(make(cell));
  cells_.push_back(nullptr);
}

std::shared_ptr<const Cell> Overlay::make(std::uint32_t number) const {
  std::vector<const Cell*> children;
  for (const std::uint32_t child : tree_.node(number).children) children.push_back(cells_[child].get());
  return std::make_shared<const Cell>(join(children, metrics_));
}

std::size_t Overlay::refresh(const Graph& graph, std::span<const ChunkId> changed) {
  std::size_t made = 0;
  std::set<std::uint32_t> parents;  // children come before their parents
  const auto replace = [&](std::uint32_t number, std::shared_ptr<const Cell> cell) {
    ++made;
    if (cell->same_passage(*cells_[number])) return;
    cells_[number] = std::move(cell);
    parents.insert(tree_.node(number).parent);
  };
  for (const ChunkId chunk : changed) {
    const std::uint32_t number = tree_.find(chunk);
    if (number == CellTree::kNone) continue;
    replace(number, std::make_shared<const Cell>(make_cell(frames_of(graph, chunk), chunk, metrics_)));
  }
  while (!parents.empty()) {
    const std::uint32_t number = parents.extract(parents.begin()).value();
    if (number != tree_.root()) replace(number, make(number));
  }
  return made;
}

std::size_t Overlay::memory_bytes() const {
  std::size_t bytes = 0;
  for (const auto& cell : cells_)
    if (cell) bytes += cell->memory_bytes();
  return bytes;
}

}  // namespace relmap
