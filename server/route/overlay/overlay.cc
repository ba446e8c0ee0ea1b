#include "server/route/overlay/overlay.h"

#include <algorithm>
#include <set>
#include <unordered_map>
#include <utility>

namespace relmap {

Overlay::Overlay(std::vector<RouteWeights> metrics) : metrics_(std::move(metrics)) {
  if (metrics_.empty() || !std::all_of(metrics_.begin(), metrics_.end(), [](const auto& m) { return m.valid(); }))
    throw StatusError(Status(Reason::INVALID_ARGUMENT, "routes need weights: each 0, or 1e-9 to 1e9, and not all 0"));
}

namespace {

// The chunks of a session that hold frames. A gap between them, of any length, is stepped over.
std::vector<ChunkId> chunks_of(const Graph& graph, const Session& session) {
  std::vector<ChunkId> chunks;
  if (session.frames == 0) return chunks;
  const auto add = [&](FrameId frame) {
    if (chunks.empty() || chunks.back() != chunk_id(frame)) chunks.push_back(chunk_id(frame));
  };
  FrameId at{session.number, session.first};
  for (;;) {
    const auto hot = graph.hot(at);
    if (hot && hot->present) add(at);
    // Frames of one camera are joined by nothing.
    const auto next = hot ? next_in_session(at, *hot) : std::nullopt;
    if (!next && at.index >= session.last) return chunks;
    at = next ? *next : FrameId{at.session, at.index + 1};
  }
}

}  // namespace

void Overlay::build(const Graph& graph) {
  std::vector<ChunkId> chunks;
  std::vector<std::shared_ptr<const Cell>> cells;
  std::unordered_map<ChunkId, std::uint32_t> places;
  for (const Session& session : graph.sessions()) {
    for (const ChunkId chunk : chunks_of(graph, session)) {
      const Cell frames = frames_of(graph, chunk);
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

Overlay::Refreshed Overlay::refresh(const Graph& graph, std::span<const ChunkId> changed) {
  Refreshed refreshed;
  std::vector<std::pair<std::uint32_t, std::shared_ptr<const Cell>>> chunks;
  for (const ChunkId chunk : changed)
    if (const std::uint32_t number = tree_.find(chunk); number != CellTree::kNone)
      chunks.emplace_back(number, std::make_shared<const Cell>(make_cell(frames_of(graph, chunk), chunk, metrics_)));
    else
      refreshed.unknown.push_back(chunk);

  std::set<std::uint32_t> parents;  // children come before their parents
  const auto replace = [&](std::uint32_t number, std::shared_ptr<const Cell> cell) {
    ++refreshed.cells;
    if (cell->same_passage(*cells_[number])) return;
    cells_[number] = std::move(cell);
    parents.insert(tree_.node(number).parent);
  };
  for (auto& [number, cell] : chunks) replace(number, std::move(cell));
  while (!parents.empty()) {
    const std::uint32_t number = parents.extract(parents.begin()).value();
    if (number != tree_.root()) replace(number, make(number));
  }
  return refreshed;
}

std::size_t Overlay::memory_bytes() const {
  std::size_t bytes = 0;
  for (const auto& cell : cells_)
    if (cell) bytes += cell->memory_bytes();
  return bytes;
}

}  // namespace relmap
