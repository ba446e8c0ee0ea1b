// The tree of nested cells, with chunks as its leaves, divided where few edges cross. It grows with the map like a
// B-tree: a new chunk is added to a cell to which edges join it, and a cell with too many parts is split in two.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <unordered_map>
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
  // Builds a tree. `chunks` are ascending, each once. `ties` say how many edges join two chunks, by their indices in
  // `chunks`.
  CellTree(std::span<const storage::ChunkId> chunks, std::vector<WeightedPair> ties);

  // Cells keep their numbers as the tree grows. A tree without chunks has no root.
  std::uint32_t size() const { return static_cast<std::uint32_t>(nodes_.size()); }
  std::uint32_t root() const { return root_; }
  const Node& node(std::uint32_t cell) const { return nodes_[cell]; }
  // The cell around a cell; kNone for the root.
  std::uint32_t parent(std::uint32_t cell) const { return parents_[cell]; }
  // The number of a chunk; kNone if the tree does not hold it.
  std::uint32_t find(storage::ChunkId chunk) const;
  // The numbers of a session's chunks, ascending by chunk.
  std::span<const std::uint32_t> chunks_of(SessionNumber session) const;
  std::uint32_t chunks() const { return chunks_; }
  std::vector<SessionNumber> sessions() const;  // those with a chunk, ascending
  std::size_t memory_bytes() const;
  void put(ByteWriter& w) const;
  // Reads what put() wrote; nullopt if the bytes are invalid.
  static std::optional<CellTree> get(ByteReader& r);
  // The number of levels below the root.
  std::uint32_t levels() const { return chunks_ == 0 ? 0 : node(root_).level; }
  // The cell of this level around a cell.
  std::uint32_t around(std::uint32_t cell, std::uint32_t level) const {
    while (nodes_[cell].level < level) cell = parents_[cell];
    return cell;
  }

  // Adds a chunk to the cell of the chunk `beside`, or, if `beside` is kNone, to some cell. The tree must not hold the
  // chunk yet. Afterwards the cell may have too many parts. Returns the chunk's number.
  std::uint32_t add(storage::ChunkId chunk, std::uint32_t beside);
  bool has_too_many_parts(std::uint32_t cell) const { return nodes_[cell].children.size() > kMaxParts; }
  // Splits a cell in two by the side, 0 or 1, of each of its children; both sides must occur. Returns the new cell,
  // which has the children of side 1.
  std::uint32_t split(std::uint32_t cell, const std::vector<std::uint8_t>& side);

 private:
  struct Part;
  std::uint32_t make(Part part, std::uint32_t level);
  void divide(Part part, std::uint32_t level, std::vector<std::uint32_t>& cells);
  std::uint32_t add_node(std::uint32_t parent, Node node);
  std::uint32_t add_chunk(storage::ChunkId chunk);  // without a parent yet
  void note_chunk(std::uint32_t number);

  double fanout_ = 1;  // the constructor makes cells of at most fanout_^level chunks
  std::uint32_t root_ = kNone, chunks_ = 0;
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> parents_;  // by cell; apart from the nodes, since searches read only these
  struct SessionChunks {
    std::vector<std::uint32_t> chunks;  // ascending
    std::vector<std::uint32_t> numbers;
  };
  std::unordered_map<SessionNumber, SessionChunks> sessions_;  // numbers have large gaps, such as after a restore
};

}  // namespace relmap::route
