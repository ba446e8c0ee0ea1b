// Which chunks lie together: cells within cells, of chunks at the bottom, divided where few edges cross.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/route/overlay/bisection.h"
#include "storage/chunk.h"

namespace relmap {

class CellTree {
 public:
  static constexpr std::uint32_t kNone = ~0u;

  struct Node {
    std::uint32_t parent = kNone;
    std::uint32_t level = 0;  // 0: a chunk
    ChunkId chunk;            // of level 0
    std::vector<std::uint32_t> children;
  };

  CellTree() = default;
  // `chunks`: each once, ascending. `ties`: how many edges join two chunks, by their places in `chunks`.
  CellTree(std::span<const ChunkId> chunks, std::vector<WeightedPair> ties);

  // Chunks come first; the root is the last; children stand before their parents.
  std::uint32_t size() const { return static_cast<std::uint32_t>(nodes_.size()); }
  std::uint32_t root() const { return size() - 1; }
  const Node& node(std::uint32_t cell) const { return nodes_[cell]; }
  // kNone: the tree does not know the chunk.
  std::uint32_t find(ChunkId chunk) const;
  // Levels below the root's.
  std::uint32_t levels() const { return node(root()).level; }
  // The chunk itself, and the cells that it lies in, by level, without the root.
  std::span<const std::uint32_t> path(std::uint32_t chunk) const {
    return std::span(paths_).subspan(std::size_t{chunk} * levels(), levels());
  }

 private:
  struct Part;
  std::uint32_t make(Part part, std::uint32_t level);
  void divide(Part part, std::uint32_t level, std::vector<std::uint32_t>& cells);

  double fanout_ = 1;  // a cell has at most fanout_^level chunks
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> paths_;
  struct SessionChunks {
    std::uint32_t number = 0;           // in the tree, of the first
    std::vector<std::uint32_t> chunks;  // ascending
  };
  std::vector<SessionChunks> sessions_;  // by number
};

}  // namespace relmap
