#include "server/route/overlay/cell_tree.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace relmap::route {
namespace {

constexpr double kFanout = 8;  // approximate number of parts of a cell that is made

}  // namespace

// Chunks, as nodes of the tree, and the edges between them.
struct CellTree::Part {
  std::vector<std::uint32_t> chunks;
  WeightedGraph graph;
};

CellTree::CellTree(std::span<const storage::ChunkId> chunks, std::vector<WeightedPair> ties) {
  if (chunks.empty()) return;
  Part all;
  for (const storage::ChunkId chunk : chunks) all.chunks.push_back(add_chunk(chunk));
  all.graph = make_weighted_graph(std::vector<std::uint32_t>(chunks.size(), 1), std::move(ties));
  const double count = std::max<double>(2, static_cast<double>(chunks.size()));
  const double levels = std::max(1.0, std::round(std::log(count) / std::log(kFanout)));
  fanout_ = std::pow(count, 1 / levels);
  root_ = make(std::move(all), static_cast<std::uint32_t>(levels));
}

std::uint32_t CellTree::add_node(std::uint32_t parent, Node node) {
  nodes_.push_back(std::move(node));
  parents_.push_back(parent);
  return size() - 1;
}

std::uint32_t CellTree::add_chunk(storage::ChunkId chunk) {
  const std::uint32_t number = add_node(kNone, {0, chunk, {}});
  note_chunk(number);
  return number;
}

void CellTree::note_chunk(std::uint32_t number) {
  const storage::ChunkId chunk = nodes_[number].chunk;
  ++chunks_;
  auto& [chunks, numbers] = sessions_[chunk.session];
  const auto at = std::lower_bound(chunks.begin(), chunks.end(), chunk.chunk) - chunks.begin();
  chunks.insert(chunks.begin() + at, chunk.chunk);
  numbers.insert(numbers.begin() + at, number);
}

void CellTree::put(ByteWriter& w) const {
  w.put(fanout_);
  w.put(root_);
  w.put(size());
  for (const Node& node : nodes_) {
    w.put(node.level);
    w.put(node.chunk.session);
    w.put(node.chunk.chunk);
    w.put(static_cast<std::uint32_t>(node.children.size()));
    w.put_array(node.children.data(), node.children.size());
  }
}

std::optional<CellTree> CellTree::get(ByteReader& r) {
  CellTree tree;
  tree.fanout_ = r.get<double>();
  tree.root_ = r.get<std::uint32_t>();
  const auto size = r.get<std::uint32_t>();
  if (!r.fits(size, 16)) return std::nullopt;
  tree.nodes_.resize(size);
  tree.parents_.assign(size, kNone);
  for (std::uint32_t number = 0; number < size; ++number) {
    Node& node = tree.nodes_[number];
    node.level = r.get<std::uint32_t>();
    node.chunk.session = r.get<SessionNumber>();
    node.chunk.chunk = r.get<std::uint32_t>();
    const auto children = r.get<std::uint32_t>();
    if (!r.fits(children, 4) || (node.level == 0) != (children == 0)) return std::nullopt;
    node.children.resize(children);
    r.get_array(node.children.data(), children);
    if (node.level == 0) tree.note_chunk(number);
    for (const std::uint32_t child : node.children) {
      if (child >= size || tree.parents_[child] != kNone) return std::nullopt;
      tree.parents_[child] = number;
    }
  }
  // Each node except the root must have a parent on the next level, so the parents have no cycle.
  if (!r.ok() || (size == 0) != (tree.root_ == kNone) || (size > 0 && tree.root_ >= size)) return std::nullopt;
  for (std::uint32_t number = 0; number < size; ++number) {
    const std::uint32_t parent = tree.parents_[number];
    if ((parent == kNone) != (number == tree.root_)) return std::nullopt;
    if (parent != kNone && tree.nodes_[parent].level != tree.nodes_[number].level + 1) return std::nullopt;
  }
  return tree;
}

std::uint32_t CellTree::find(storage::ChunkId chunk) const {
  const auto session = sessions_.find(chunk.session);
  if (session == sessions_.end()) return kNone;
  const auto& [chunks, numbers] = session->second;
  // As a rule a session's chunks are consecutive.
  const std::uint32_t place = chunk.chunk - chunks.front();
  if (place < chunks.size() && chunks[place] == chunk.chunk) return numbers[place];
  const auto found = std::lower_bound(chunks.begin(), chunks.end(), chunk.chunk);
  return found == chunks.end() || *found != chunk.chunk ? kNone
                                                        : numbers[static_cast<std::size_t>(found - chunks.begin())];
}

std::span<const std::uint32_t> CellTree::chunks_of(SessionNumber session) const {
  const auto found = sessions_.find(session);
  return found == sessions_.end() ? std::span<const std::uint32_t>() : found->second.numbers;
}

std::vector<SessionNumber> CellTree::sessions() const {
  std::vector<SessionNumber> numbers;
  numbers.reserve(sessions_.size());
  for (const auto& [number, chunks] : sessions_) numbers.push_back(number);
  std::sort(numbers.begin(), numbers.end());
  return numbers;
}

std::size_t CellTree::memory_bytes() const {
  // A node, and its number in its parent and in its session; allows for the unused capacity of vectors that grow.
  return nodes_.capacity() * (sizeof(Node) + 3 * sizeof(std::uint32_t)) + std::size_t{chunks_} * 16;
}

std::uint32_t CellTree::add(storage::ChunkId chunk, std::uint32_t beside) {
  const std::uint32_t number = add_chunk(chunk);
  if (root_ == kNone) {
    root_ = add_node(kNone, {1, {}, {}});
    beside = root_;
  } else if (beside == kNone) {
    for (beside = root_; nodes_[beside].level > 1;) beside = nodes_[beside].children.back();
  }
  const std::uint32_t cell = around(beside, 1);
  parents_[number] = cell;
  nodes_[cell].children.push_back(number);
  return number;
}

std::uint32_t CellTree::split(std::uint32_t cell, const std::vector<std::uint8_t>& side) {
  if (cell == root_) {
    root_ = add_node(kNone, {nodes_[cell].level + 1, {}, {cell}});
    parents_[cell] = root_;
  }
  const std::uint32_t other = add_node(parents_[cell], {nodes_[cell].level, {}, {}});
  nodes_[parents_[cell]].children.push_back(other);
  std::vector<std::uint32_t> stay;
  for (std::size_t i = 0; i < side.size(); ++i) {
    const std::uint32_t child = nodes_[cell].children[i];
    if (side[i] == 0) {
      stay.push_back(child);
    } else {
      parents_[child] = other;
      nodes_[other].children.push_back(child);
    }
  }
  nodes_[cell].children = std::move(stay);
  return other;
}

std::uint32_t CellTree::make(Part part, std::uint32_t level) {
  std::vector<std::uint32_t> children;
  if (level == 1)
    children = std::move(part.chunks);
  else
    divide(std::move(part), level - 1, children);
  const std::uint32_t cell = add_node(kNone, {level, {}, {}});
  for (const std::uint32_t child : children) parents_[child] = cell;
  nodes_[cell].children = std::move(children);
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

}  // namespace relmap::route
