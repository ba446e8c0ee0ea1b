// Which chunks lie together: cells within cells, of chunks at the bottom, divided where few edges cross. It grows with
// the map as a B-tree does: a new chunk goes to the cell that it is joined to, and a cell with too many parts becomes
// two.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "proto/base/bytes.h"
#include "server/route/overlay/bisection.h"
#include "storage/graph/chunk.h"

namespace relmap::route {

class CellTree {
 public:
  static constexpr std::uint32_t kNone = ~0u;
  static constexpr std::size_t kMaxParts = 16;  // of a cell

  struct Node {
    std::uint32_t level = 0;  // 0: a chunk
    storage::ChunkId chunk;   // of level 0
    std::vector<std::uint32_t> children;
  };

  CellTree() = default;
  // `chunks`: each once, ascending. `ties`: how many edges join two chunks, by their places in `chunks`.
  CellTree(std::span<const storage::ChunkId> chunks, std::vector<WeightedPair> ties);

  // Cells keep their numbers. Of a tree without chunks there is no root.
  std::uint32_t size() const { return static_cast<std::uint32_t>(nodes_.size()); }
  std::uint32_t root() const { return root_; }
  const Node& node(std::uint32_t cell) const { return nodes_[cell]; }
  // kNone: it is the root.
  std::uint32_t parent(std::uint32_t cell) const { return parents_[cell]; }
  // kNone: the tree does not know the chunk.
  std::uint32_t find(storage::ChunkId chunk) const;
  // Chunks of a session that the tree knows, ascending.
  std::span<const std::uint32_t> chunks_of(SessionNumber session) const;
  std::uint32_t chunks() const { return chunks_; }
  SessionNumber sessions() const { return static_cast<SessionNumber>(sessions_.size()); }  // numbers are below it
  std::size_t memory_bytes() const;
  void put(ByteWriter& w) const;
  // What put() put; nullopt: the bytes are not that.
  static std::optional<CellTree> get(ByteReader& r);
  // Levels below the root's.
  std::uint32_t levels() const { return chunks_ == 0 ? 0 : node(root_).level; }
  // The cell of this level around a cell.
  std::uint32_t around(std::uint32_t cell, std::uint32_t level) const {
    while (nodes_[cell].level < level) cell = parents_[cell];
    return cell;
  }

  // A chunk that the tree does not know, into the cell of one that it knows; kNone: it is joined to none. The cell may
  // have too many parts then. Returns the chunk's number.
  std::uint32_t add(storage::ChunkId chunk, std::uint32_t beside);
  bool has_too_many_parts(std::uint32_t cell) const { return nodes_[cell].children.size() > kMaxParts; }
  // Into two: `side` of each of its children, both of which occur. Returns the new one, which has those of side 1.
  std::uint32_t split(std::uint32_t cell, const std::vector<std::uint8_t>& side);

 private:
  struct Part;
  std::uint32_t make(Part part, std::uint32_t level);
  void divide(Part part, std::uint32_t level, std::vector<std::uint32_t>& cells);
  std::uint32_t add_node(std::uint32_t parent, Node node);
  std::uint32_t add_chunk(storage::ChunkId chunk);  // without a parent yet
  void note_chunk(std::uint32_t number);

  double fanout_ = 1;  // a cell that is made has at most fanout_^level chunks
  std::uint32_t root_ = kNone, chunks_ = 0;
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> parents_;  // searches climb them
  struct SessionChunks {
    std::vector<std::uint32_t> chunks;  // ascending
    std::vector<std::uint32_t> numbers;
  };
  std::vector<SessionChunks> sessions_;  // by number
};

}  // namespace relmap::route
