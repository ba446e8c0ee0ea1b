#include "server/route/overlay/reachability.h"

#include <algorithm>
#include <unordered_map>
#include <unordered_set>

#include "server/route/overlay/disjoint_sets.h"
#include "server/route/overlay/stale.h"

namespace relmap {
namespace {

// The map in pieces: cells that hang together, each one element; of other chunks, and of those that are looked at
// frame by frame, each frame.
class Pieces {
 public:
  Pieces(const Overlay& overlay, std::unordered_map<ChunkId, CellFrames> opened, const WorkLimit& work)
      : overlay_(overlay), tree_(overlay.tree()), opened_(std::move(opened)), work_(work) {
    piece_of_.assign(tree_.size(), CellFrames::kNone);
    for (const auto& [chunk, frames] : opened_) {
      opened_pieces_.emplace(chunk, static_cast<std::uint32_t>(pieces_.size()));
      add(nullptr, frames);
    }
    if (tree_.chunks() > 0) divide();
    for (const Piece& piece : pieces_) join(piece);
  }

  // The set that a frame is of; kNone: it has no edges out of its chunk, which is not opened.
  std::uint32_t find(FrameId frame) {
    const std::uint32_t element = element_of(frame);
    return element == CellFrames::kNone ? element : sets_.find(element);
  }
  // Sessions of the frames in any of these sets.
  std::set<SessionNumber> sessions(const std::unordered_set<std::uint32_t>& reached) {
    std::set<SessionNumber> sessions;
    for (const Piece& piece : pieces_)
      for (std::uint32_t i = 0; !piece.joined && i < piece.frames.nodes.size(); ++i)
        if (reached.contains(sets_.find(piece.first + i))) sessions.insert(piece.frames.nodes[i].session);
    for (SessionNumber session = 0; session < tree_.sessions(); ++session)
      for (const std::uint32_t chunk : tree_.chunks_of(session)) {
        if (sessions.contains(session)) break;
        const std::uint32_t piece = piece_around(chunk);
        if (piece != CellFrames::kNone && pieces_[piece].joined && reached.contains(sets_.find(pieces_[piece].first)))
          sessions.insert(session);
      }
    return sessions;
  }

 private:
  struct Piece {
    const StoredCell* cell;  // null: a chunk that is opened
    CellFrames frames;
    bool joined;
    std::uint32_t first;  // element
  };

  std::uint32_t add(const StoredCell* cell, CellFrames frames) {
    if (pieces_.size() % kPiecesBetweenLooks == 0 && work_.proceed)
      if (Status status = work_.proceed(bytes_); !status.ok()) throw StatusError(status);
    bytes_ += sizeof(Piece) + frames.memory_bytes();
    const bool joined = cell && cell->facts().joined;
    const std::uint32_t first = sets_.add(joined ? 1 : frames.nodes.size());
    pieces_.push_back({cell, std::move(frames), joined, first});
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
        piece_of_[number] = add(cell, cell->read_frames());
    }
  }
  void join(const Piece& piece) {
    if (piece.cell && !piece.joined) {
      const CostMatrix within = piece.cell->read_within(0);
      for (std::uint32_t i = 0; i < within.size(); ++i)
        for (std::uint32_t j = 0; j < within.size(); ++j)
          if (within(i, j) < kUnreachable) sets_.join(piece.first + i, piece.first + j);
    }
    for (std::uint32_t i = 0; i < piece.frames.nodes.size(); ++i)
      for (const Link& link : piece.frames.links_of(i))
        // What the overlay says of an edge to a chunk that was opened may be out of date.
        if (!piece.cell || !opened_.contains(chunk_id(link.to)))
          if (const std::uint32_t end = element_of(link.to); end != CellFrames::kNone)
            sets_.join(piece.first + (piece.joined ? 0 : i), end);
  }
  std::uint32_t piece_around(std::uint32_t cell) const {
    while (cell != CellTree::kNone && piece_of_[cell] == CellFrames::kNone) cell = tree_.parent(cell);
    return cell == CellTree::kNone ? CellFrames::kNone : piece_of_[cell];
  }
  std::uint32_t element_of(FrameId frame) const {
    const auto opened = opened_pieces_.find(chunk_id(frame));
    const std::uint32_t number = opened == opened_pieces_.end() ? tree_.find(chunk_id(frame)) : CellTree::kNone;
    const std::uint32_t at = opened == opened_pieces_.end() ? piece_around(number) : opened->second;
    if (at == CellFrames::kNone) return CellFrames::kNone;
    const Piece& piece = pieces_[at];
    if (piece.joined) return piece.first;
    const std::uint32_t node = piece.frames.find(frame);
    return node == CellFrames::kNone ? node : piece.first + node;
  }

  static constexpr std::size_t kPiecesBetweenLooks = 64;  // at the clock: each may be read from disk

  const Overlay& overlay_;
  const CellTree& tree_;
  const std::unordered_map<ChunkId, CellFrames> opened_;
  const WorkLimit& work_;
  std::unordered_map<ChunkId, std::uint32_t> opened_pieces_;
  std::vector<std::uint32_t> piece_of_;  // by the tree's numbers
  std::vector<Piece> pieces_;
  DisjointSets sets_;
  std::size_t bytes_ = 0;
};

}  // namespace

Reachability::Reachability(const Overlay& overlay, const Graph& graph, std::span<const ChunkId> stale,
                           std::span<const FrameId> from, std::span<const FrameId> to, const WorkLimit& work) {
  std::unordered_map<ChunkId, CellFrames> opened = frames_of_stale(overlay, graph, stale, work);
  for (const auto& ends : {from, to})
    for (const FrameId frame : ends)
      if (!opened.contains(chunk_id(frame))) opened.emplace(chunk_id(frame), frames_of(graph, chunk_id(frame)));
  Pieces pieces(overlay, std::move(opened), work);
  std::unordered_set<std::uint32_t> reached;
  for (const FrameId frame : from)
    if (const std::uint32_t set = pieces.find(frame); set != CellFrames::kNone) reached.insert(set);
  for (const FrameId frame : to) goal_ |= reached.contains(pieces.find(frame));
  sessions_ = pieces.sessions(reached);
}

}  // namespace relmap
