// Counts reads of a graph, for tests of costs.
#pragma once

#include <cstddef>

#include "storage/graph/forwarding_graph.h"

namespace relmap::map {

class CountingGraph final : public storage::ForwardingGraph<storage::Graph> {
 public:
  explicit CountingGraph(const storage::Graph& graph) : ForwardingGraph(graph) {}

  std::shared_ptr<const storage::FrameHot> hot(FrameId id) const override {
    ++hot_reads_;
    return ForwardingGraph::hot(id);
  }
  std::size_t hot_reads() const { return hot_reads_; }

 private:
  mutable std::size_t hot_reads_ = 0;
};

}  // namespace relmap::map
