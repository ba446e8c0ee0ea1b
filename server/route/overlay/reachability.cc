#include "server/route/overlay/reachability.h"

#include <algorithm>
#include <unordered_map>
#include <unordered_set>

#include "server/route/overlay/disjoint_sets.h"
#include "server/route/overlay/stale.h"
#include "server/route/refusal.h"

namespace relmap::route {
namespace {

// The map as elements of disjoint sets. Each cell whose frames are connected is one element; other chunks, and those
// that are opened, have one element for each frame.
class Pieces {
 public:
  Pieces(const Overlay& overlay, const std::unordered_map<storage::ChunkId, CellFrames>& opened, const WorkLimit& work)
      : overlay_(overlay), tree_(overlay.tree()), opened_(opened), work_(work) {
    piece_of_.assign(tree_.size(), CellFrames::kNone);
    bytes_ = piece_of_.size() * sizeof(piece_of_[0]);
    for (const auto& [chunk, frames] : opened_) {
      bytes_ += frames.memory_bytes();
      opened_pieces_.emplace(chunk, static_cast<std::uint32_t>(pieces_.size()));
      add(nullptr, frames.nodes);
    }
    if (tree_.chunks() > 0) divide();
    for (const auto& [chunk, frames] : opened_) join(pieces_[opened_pieces_.at(chunk)], frames);
    for (const Piece& piece : pieces_) {
      if (!piece.cell) continue;
      look();
      join(piece, piece.cell->read_frames());
    }
  }

  // The set of a frame; kNone if it has no edges out of its chunk and the chunk is not opened.
  std::uint32_t find(FrameId frame) {
    const std::uint32_t element = element_of(frame);
    return element == CellFrames::kNone ? element : sets_.find(element);
  }
  // The sessions of the frames in any of these sets.
  std::set<SessionNumber> sessions(const std::unordered_set<std::uint32_t>& reached) {
    std::set<SessionNumber> sessions;
    for (const Piece& piece : pieces_)
      for (std::uint32_t i = 0; i < piece.nodes.size(); ++i)
        if (reached.contains(sets_.find(piece.first + i))) sessions.insert(piece.nodes[i].session);
    for (const SessionNumber session : tree_.sessions())
      for (const std::uint32_t chunk : tree_.chunks_of(session)) {
        if (sessions.contains(session)) break;
        const std::uint32_t piece = piece_around(chunk);
        if (piece != CellFrames::kNone && pieces_[piece].joined && is_led_into(chunk) &&
            reached.contains(sets_.find(pieces_[piece].first)))
          sessions.insert(session);
      }
    return sessions;
  }

 private:
  struct Piece {
    const StoredCell* cell;  // null for a chunk that is opened
    bool joined;
    std::uint32_t first;         // its first element
    std::vector<FrameId> nodes;  // the frames of its elements; empty if it is joined
  };

  void look() {
    if (looks_++ % kPiecesBetweenLooks == 0 && work_.proceed)
      if (Status status = work_.proceed(bytes_); !status.ok()) throw StatusError(status);
  }
  std::uint32_t add(const StoredCell* cell, std::vector<FrameId> nodes) {
    look();
    const bool joined = cell && cell->facts().joined;
    const std::uint32_t first = sets_.add(joined ? 1 : nodes.size());
    bytes_ += sizeof(Piece) + sizeof first + nodes.size() * (sizeof(FrameId) + sizeof first);
    pieces_.push_back({cell, joined, first, std::move(nodes)});
    return static_cast<std::uint32_t>(pieces_.size() - 1);
  }
  void divide() {
    std::unordered_set<std::uint32_t> around_opened;
    for (const auto& [chunk, frames] : opened_)
      for (std::uint32_t cell = tree_.find(chunk); cell != CellTree::kNone; cell = tree_.parent(cell))
        if (!around_opened.insert(cell).second) break;
    std::vector<std::uint32_t> left{tree_.root()};
    while (!left.empty()) {
      const std::uint32_t number = left.back();
      left.pop_back();
      const auto& children = tree_.node(number).children;
      const StoredCell* cell = overlay_.cell(number);
      if (around_opened.contains(number) || !cell || (!cell->facts().joined && !children.empty()))
        left.insert(left.end(), children.begin(), children.end());
      else
        piece_of_[number] = add(cell, cell->facts().joined ? std::vector<FrameId>() : cell->read_frames().nodes);
    }
  }
  void join(const Piece& piece, const CellFrames& frames) {
    if (piece.cell && !piece.joined) {
      const CostMatrix within = piece.cell->read_within(0);
      for (std::uint32_t i = 0; i < within.size(); ++i)
        for (std::uint32_t j = 0; j < within.size(); ++j)
          if (within(i, j) < kUnreachable) sets_.join(piece.first + i, piece.first + j);
    }
    for (std::uint32_t i = 0; i < frames.nodes.size(); ++i)
      for (const Link& link : frames.links_of(i))
        // An edge of the overlay to a chunk that is opened may be out of date.
        if (!piece.cell || !opened_.contains(storage::chunk_id(link.to)))
          if (const std::uint32_t end = element_of(link.to); end != CellFrames::kNone)
            sets_.join(piece.first + (piece.joined ? 0 : i), end);
  }
  std::uint32_t piece_around(std::uint32_t cell) const {
    while (cell != CellTree::kNone && piece_of_[cell] == CellFrames::kNone) cell = tree_.parent(cell);
    return cell == CellTree::kNone ? CellFrames::kNone : piece_of_[cell];
  }
  // Whether edges lead into the cell from the rest of the piece around it.
  bool is_led_into(std::uint32_t cell) const {
    for (; piece_of_[cell] == CellFrames::kNone; cell = tree_.parent(cell))
      if (overlay_.cell(cell)->nodes() == 0) return false;
    return true;
  }
  std::uint32_t element_of(FrameId frame) const {
    const auto opened = opened_pieces_.find(storage::chunk_id(frame));
    const std::uint32_t at =
        opened == opened_pieces_.end() ? piece_around(tree_.find(storage::chunk_id(frame))) : opened->second;
    if (at == CellFrames::kNone) return CellFrames::kNone;
    const Piece& piece = pieces_[at];
    if (piece.joined) return piece.first;
    const auto node = std::lower_bound(piece.nodes.begin(), piece.nodes.end(), frame);
    return node == piece.nodes.end() || *node != frame
               ? CellFrames::kNone
               : piece.first + static_cast<std::uint32_t>(node - piece.nodes.begin());
  }

  static constexpr std::size_t kPiecesBetweenLooks = 64;  // between calls of proceed; each piece may be read from disk

  const Overlay& overlay_;
  const CellTree& tree_;
  const std::unordered_map<storage::ChunkId, CellFrames>& opened_;
  const WorkLimit& work_;
  std::unordered_map<storage::ChunkId, std::uint32_t> opened_pieces_;
  std::vector<std::uint32_t> piece_of_;  // by the number in the tree
  std::vector<Piece> pieces_;
  DisjointSets sets_;
  std::size_t bytes_ = 0, looks_ = 0;
};

}  // namespace

Reachability::Reachability(const Overlay& overlay, const storage::Graph& graph, std::span<const storage::ChunkId> stale,
                           std::span<const FrameId> from, std::span<const FrameId> to, const WorkLimit& work) {
  std::unordered_map<storage::ChunkId, CellFrames> opened = frames_of_stale(overlay, graph, stale, work);
  std::size_t bytes = 0;
  for (const auto& [chunk, frames] : opened) bytes += frames.memory_bytes();
  for (const auto& ends : {from, to})
    for (const FrameId frame : ends) {
      if (opened.contains(storage::chunk_id(frame))) continue;
      if (work.proceed)
        if (Status status = work.proceed(bytes); !status.ok()) throw StatusError(status);
      const auto at = opened.emplace(storage::chunk_id(frame), frames_of(graph, storage::chunk_id(frame))).first;
      bytes += at->second.memory_bytes();
    }
  Pieces pieces(overlay, opened, work);
  std::unordered_set<std::uint32_t> reached;
  for (const FrameId frame : from)
    if (const std::uint32_t set = pieces.find(frame); set != CellFrames::kNone) reached.insert(set);
  for (const FrameId frame : to) goal_ |= reached.contains(pieces.find(frame));
  sessions_ = pieces.sessions(reached);
}

Status check_joined(const Overlay& overlay, const storage::Graph& graph, std::span<const storage::ChunkId> stale,
                    std::span<const FrameId> from, std::span<const FrameId> to, const WorkLimit& work) {
  const Reachability joined(overlay, graph, stale, from, to, work);
  if (joined.goal()) return {};
  return not_connected(graph, joined.sessions(), to, false, false);
}

}  // namespace relmap::route
