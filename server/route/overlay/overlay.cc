#include "server/route/overlay/overlay.h"

#include <algorithm>
#include <unordered_map>
#include <utility>

#include "server/route/overlay/joining.h"
#include "server/route/overlay/stale.h"

namespace relmap::route {

Overlay::Overlay(std::vector<RouteWeights> metrics, std::shared_ptr<CellStore> store)
    : metrics_(std::move(metrics)), store_(std::move(store)) {
  if (metrics_.empty() || !std::all_of(metrics_.begin(), metrics_.end(), [](const auto& m) { return m.valid(); }))
    throw StatusError(Status(Reason::INVALID_ARGUMENT, "routes need weights: each 0, or 1e-9 to 1e9, and not all 0"));
}

namespace {

constexpr std::size_t kNodeBytes = 48;  // of a set, about

// The chunk after `chunk`, whose frames are given; a gap that a motion edge bridges is skipped in one step. nullopt if
// it is the last.
std::optional<storage::ChunkId> next_chunk(const storage::Graph& graph, const storage::Session& session,
                                           storage::ChunkId chunk, const CellFrames& frames) {
  const storage::ChunkId next{chunk.session, chunk.chunk + 1};
  if (!frames.nodes.empty()) {
    const auto hot = graph.hot(frames.nodes.back());
    if (const auto on = hot ? storage::next_in_session(frames.nodes.back(), *hot) : std::nullopt;
        on && storage::chunk_id(*on) > chunk)
      return storage::chunk_id(*on);
  }
  // Frames of mono sessions have no edges.
  return next.chunk <= storage::chunk_of({session.number, session.last}) ? std::optional(next) : std::nullopt;
}

}  // namespace

void Overlay::build(const storage::Graph& graph, const Proceed& proceed) {
  const auto check = [&](std::size_t bytes) {
    if (!proceed) return;
    if (Status status = proceed(bytes); !status.ok()) throw StatusError(status);
  };
  Overlay made(metrics_, store_);
  std::vector<storage::ChunkId> chunks;
  struct Tie {
    std::uint32_t from;
    storage::ChunkId to;
  };
  std::vector<Tie> ties;
  std::unordered_map<storage::ChunkId, std::uint32_t> places;
  graph.visit_sessions(0, [&](const storage::Session& session) {
    if (session.frames == 0) return true;
    for (auto chunk = std::optional(storage::chunk_id({session.number, session.first})); chunk;) {
      check(made.memory_bytes() + ties.size() * sizeof(Tie) + chunks.size() * 64);
      const CellFrames frames = frames_of(graph, *chunk);
      if (!frames.nodes.empty()) {
        const Cell cell = make_cell(frames, *chunk, metrics_);
        const auto number = static_cast<std::uint32_t>(chunks.size());
        for (const Link& link : cell.frames.links) ties.push_back({number, storage::chunk_id(link.to)});
        places.emplace(*chunk, number);
        chunks.push_back(*chunk);
        made.cells_.push_back(store_->write(cell));
      }
      chunk = next_chunk(graph, session, *chunk, frames);
    }
    return true;
  });
  std::vector<WeightedPair> pairs;
  for (const Tie& tie : ties)
    if (const auto other = places.find(tie.to); other != places.end() && tie.from < other->second)
      pairs.push_back({tie.from, other->second, 1});
  ties = {};
  made.tree_ = std::make_shared<CellTree>(chunks, std::move(pairs));
  made.cells_.resize(made.tree_->size());
  made.waits_.resize(made.tree_->size());
  for (auto cell = static_cast<std::uint32_t>(chunks.size()); cell < made.tree_->size(); ++cell) {
    if (cell == made.tree_->root()) continue;
    check(made.memory_bytes());
    made.cells_[cell] = made.make(cell, nullptr);
  }
  *this = std::move(made);
}

std::shared_ptr<const StoredCell> Overlay::make(std::uint32_t number, std::shared_ptr<const StoredCell> known) const {
  const std::vector<std::uint32_t>& children = tree_->node(number).children;
  std::vector<CellFrames> frames;
  std::vector<CellFacts> facts;
  for (const std::uint32_t child : children) {
    frames.push_back(cells_[child]->read_frames());
    facts.push_back(cells_[child]->facts());
  }
  const Joining joined(std::move(frames), facts);
  return store_->write(
      joined.facts(), joined.frames(), metrics_.size(),
      [&](std::size_t metric) {
        std::vector<CostMatrix> parts;
        for (const std::uint32_t child : children) parts.push_back(cells_[child]->read_within(metric));
        return joined.within(metrics_[metric], std::move(parts));
      },
      std::move(known));
}

// Marks a cell as outdated, since a part of it has changed.
void Overlay::outdate(std::uint32_t number) {
  if (number == tree_->root()) return;
  outdated_.insert(number);
  for (; number != tree_->root() && !waits_[number]; number = tree_->parent(number)) {
    waits_[number] = true;
    waiting_.insert({tree_->node(number).level, number});
  }
}

std::size_t Overlay::refresh(const storage::Graph& graph, std::span<const storage::ChunkId> changed) {
  std::vector<std::pair<std::uint32_t, std::shared_ptr<const StoredCell>>> made;
  std::map<storage::ChunkId, NewChunk> came;
  for (const auto& [chunk, frames] : frames_of_stale(*this, graph, changed)) {
    const std::uint32_t number = tree_->find(chunk);
    if (number == CellTree::kNone && frames.nodes.empty()) continue;
    const Cell cell = make_cell(frames, chunk, metrics_);
    if (number != CellTree::kNone) {
      if (frames.nodes.empty())
        gone_.insert(number);
      else
        gone_.erase(number);
      made.emplace_back(number, store_->write(cell, cells_[number]));
    } else {
      NewChunk& fresh = came[chunk];
      for (const Link& link : cell.frames.links) fresh.ties.push_back(storage::chunk_id(link.to));
      fresh.cell = store_->write(cell);
    }
  }
  for (auto& [number, cell] : made) {
    if (cell == cells_[number]) continue;
    cells_[number] = std::move(cell);
    outdate(tree_->parent(number));
  }
  add(came);
  return made.size() + came.size();
}

void Overlay::note_gone(const storage::Graph& graph) {
  for (const SessionNumber number : tree_->sessions()) {
    const auto session = graph.session(number);
    if (session && session->frames > 0) continue;
    const auto chunks = tree_->chunks_of(number);
    gone_.insert(chunks.begin(), chunks.end());
  }
}

// Adds each chunk beside the one to which most of its edges lead, of the chunks that the tree holds by then.
void Overlay::add(const std::map<storage::ChunkId, NewChunk>& came) {
  if (came.empty()) return;
  std::vector<storage::ChunkId> chunks;
  for (const auto& [chunk, fresh] : came) chunks.push_back(chunk);
  if (tree_.use_count() > 1) tree_ = std::make_shared<CellTree>(*tree_);  // others read it
  std::set<std::uint32_t> grown;
  const auto put = [&](storage::ChunkId chunk, std::uint32_t beside) {
    const std::uint32_t number = tree_->add(chunk, beside);
    cells_.resize(tree_->size());
    waits_.resize(tree_->size());
    cells_[number] = came.at(chunk).cell;
    outdate(tree_->parent(number));
    grown.insert(tree_->parent(number));
  };
  const auto max_joined = [&](storage::ChunkId chunk) {
    std::map<std::uint32_t, int> ties;
    for (const storage::ChunkId other : came.at(chunk).ties)
      if (const std::uint32_t to = tree_->find(other); to != CellTree::kNone) ++ties[to];
    const auto max_ties =
        std::max_element(ties.begin(), ties.end(), [](const auto& x, const auto& y) { return x.second < y.second; });
    return max_ties == ties.end() ? CellTree::kNone : max_ties->first;
  };
  while (!chunks.empty()) {
    const std::size_t before = chunks.size();
    std::erase_if(chunks, [&](storage::ChunkId chunk) {
      const std::uint32_t beside = max_joined(chunk);
      if (beside == CellTree::kNone) return false;
      put(chunk, beside);
      return true;
    });
    if (chunks.size() < before) continue;
    put(chunks.front(), CellTree::kNone);
    chunks.erase(chunks.begin());
  }
  for (const std::uint32_t cell : grown)
    if (tree_->has_too_many_parts(cell)) divide(cell);
}

void Overlay::divide(std::uint32_t number) {
  const std::vector<std::uint32_t>& children = tree_->node(number).children;
  const std::uint32_t level = tree_->node(number).level - 1;
  std::unordered_map<std::uint32_t, std::uint32_t> places;
  for (std::uint32_t i = 0; i < children.size(); ++i) places.emplace(children[i], i);
  std::vector<WeightedPair> ties;
  for (std::uint32_t i = 0; i < children.size(); ++i)
    for_each_link(children[i], [&](const Link& link) {
      const std::uint32_t chunk = tree_->find(storage::chunk_id(link.to));
      if (chunk == CellTree::kNone) return;
      if (const auto other = places.find(tree_->around(chunk, level)); other != places.end() && i < other->second)
        ties.push_back({i, other->second, 1});
    });
  const std::vector<std::uint8_t> side =
      bisect(make_weighted_graph(std::vector<std::uint32_t>(children.size(), 1), std::move(ties)));
  const std::uint32_t other = tree_->split(number, side);
  cells_.resize(tree_->size());
  waits_.resize(tree_->size());
  for (const std::uint32_t half : {number, other}) {
    cells_[half] = nullptr;
    outdate(half);
    if (tree_->has_too_many_parts(half)) divide(half);
  }
  if (const std::uint32_t around = tree_->parent(number); tree_->has_too_many_parts(around)) divide(around);
}

template <typename Visit>
void Overlay::for_each_link(std::uint32_t number, const Visit& visit) const {
  if (cells_[number]) {
    const auto frames = cells_[number]->frames();
    std::for_each(frames->links.begin(), frames->links.end(), visit);
  } else {
    for (const std::uint32_t child : tree_->node(number).children) for_each_link(child, visit);
  }
}

bool Overlay::make_next() {
  if (waiting_.empty()) return false;
  const std::uint32_t number = waiting_.begin()->second;
  std::shared_ptr<const StoredCell> cell = cells_[number];
  // If no direct part has changed, the changes within it make no difference to this cell.
  if (outdated_.contains(number)) cell = make(number, cell);
  waiting_.erase(waiting_.begin());
  waits_[number] = false;
  outdated_.erase(number);
  if (cell == cells_[number]) return true;
  cells_[number] = std::move(cell);
  outdate(tree_->parent(number));
  return true;
}

std::size_t Overlay::memory_bytes() const {
  // Counts a StoredCell and its shared count for each cell, and the vectors twice: here and in the copy that searches
  // use.
  return cells_.size() * (sizeof(StoredCell) + 32) +
         2 * (cells_.capacity() * sizeof(cells_[0]) + waiting_.size() * 128 + gone_.size() * kNodeBytes +
              tree_->memory_bytes());
}

void Overlay::put(ByteWriter& w) const {
  w.put(static_cast<std::uint32_t>(metrics_.size()));
  for (const RouteWeights& metric : metrics_) {
    w.put(metric.metre);
    w.put(metric.driven_second);
    w.put(metric.standing_second);
    w.put(metric.square_metre_of_variance);
  }
  tree_->put(w);
  for (std::uint32_t number = 0; number < tree_->size(); ++number) {
    w.put(cells_[number] != nullptr);
    if (cells_[number]) store_->put(w, *cells_[number]);
    w.put(static_cast<bool>(waits_[number]));
    w.put(outdated_.contains(number));
  }
}

std::optional<Overlay> Overlay::get(ByteReader& r, std::shared_ptr<CellStore> store) {
  std::vector<RouteWeights> metrics(std::min<std::uint32_t>(r.get<std::uint32_t>(), 1000));
  for (RouteWeights& metric : metrics) {
    metric.metre = r.get<double>();
    metric.driven_second = r.get<double>();
    metric.standing_second = r.get<double>();
    metric.square_metre_of_variance = r.get<double>();
  }
  auto tree = CellTree::get(r);
  if (!tree || metrics.empty() || !std::all_of(metrics.begin(), metrics.end(), [](const auto& m) { return m.valid(); }))
    return std::nullopt;
  Overlay overlay(std::move(metrics), std::move(store));
  overlay.tree_ = std::make_shared<CellTree>(*std::move(tree));
  overlay.cells_.resize(overlay.tree_->size());
  overlay.waits_.resize(overlay.tree_->size());
  for (std::uint32_t number = 0; number < overlay.tree_->size(); ++number) {
    if (r.get<std::uint8_t>() != 0 && !(overlay.cells_[number] = overlay.store_->get(r))) return std::nullopt;
    overlay.waits_[number] = r.get<std::uint8_t>() != 0;
    if (overlay.waits_[number]) overlay.waiting_.insert({overlay.tree_->node(number).level, number});
    if (r.get<std::uint8_t>() != 0) overlay.outdated_.insert(number);
    const bool root = number == overlay.tree_->root();
    const bool wanted = !root && !overlay.waits_[number];
    // Searches open chunks wherever larger cells are outdated, so a chunk never waits; the root is no cell.
    const bool may_wait = !root && overlay.tree_->node(number).level > 0;
    if (!r.ok() || (overlay.waits_[number] && !may_wait) || (wanted && !overlay.cells_[number])) return std::nullopt;
  }
  return overlay;
}

}  // namespace relmap::route
