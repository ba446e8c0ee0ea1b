// Shortest routes through maps of millions of frames: nested cells, each with the costs of passing it ("Customizable
// route planning", Delling et al., SEA 2011). A search walks frames where it begins and ends, and cells, the larger
// the further, between.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "proto/status.h"
#include "server/route/overlay/cell.h"
#include "server/route/overlay/cell_tree.h"
#include "server/route/work_limit.h"

namespace relmap {

// The way through one cell of the map, or over one edge.
struct Hop {
  FrameId from, to;
  std::uint32_t cell = CellTree::kNone;  // none: over `link`
  EdgeId edge;
  bool forward = false;
};

struct OverlayRoute {
  double cost = 0;
  std::vector<Hop> hops;  // one after the other; none: it begins where it ends
  FrameId from, to;
  std::uint64_t nodes_settled = 0;
  std::uint32_t cells_entered = 0, chunks_opened = 0;
};

class Overlay {
 public:
  // At least one; throws StatusError, INVALID_ARGUMENT, where one is not valid().
  explicit Overlay(std::vector<RouteWeights> metrics);

  // Of the whole map. Throws StatusError where reads of the graph do.
  void build(const Graph& graph);
  struct Refreshed {
    std::size_t cells = 0;         // made anew
    std::vector<ChunkId> unknown;  // by which the map has grown since build(): they are on no route before the next
  };
  // After edges at frames of these chunks changed. Throws as build() does, and then nothing has changed.
  Refreshed refresh(const Graph& graph, std::span<const ChunkId> changed);

  std::span<const RouteWeights> metrics() const { return metrics_; }
  const CellTree& tree() const { return tree_; }
  // Null: it is the root.
  const Cell* cell(std::uint32_t number) const { return cells_[number].get(); }
  std::size_t memory_bytes() const;

 private:
  std::shared_ptr<const Cell> make(std::uint32_t number) const;

  const std::vector<RouteWeights> metrics_;
  CellTree tree_;
  std::vector<std::shared_ptr<const Cell>> cells_;  // by their numbers in the tree
};

// The cheapest route by overlay.metrics()[metric] from any of `from` to any of `to`. `graph`: the map that the overlay
// is of. NO_SUCH_FRAME (or it came after build()), NOT_CONNECTED, OUT_OF_REACH, and what work.proceed says. Throws
// StatusError where reads of the graph do.
Result<OverlayRoute> find_route(const Overlay& overlay, const Graph& graph, std::size_t metric,
                                std::span<const FrameId> from, std::span<const FrameId> to, const WorkLimit& work = {});

// The same way with no cell in it that is larger than a chunk. Not ok: the route is as it was.
Status unpack(const Overlay& overlay, const Graph& graph, std::size_t metric, OverlayRoute& route,
              const WorkLimit& work = {});

}  // namespace relmap
