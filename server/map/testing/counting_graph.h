// Counts what is read of a graph. For tests of what something costs.
#pragma once

#include <cstddef>

#include "storage/forwarding_graph.h"

namespace relmap {

class CountingGraph final : public ForwardingGraph<Graph> {
 public:
  explicit CountingGraph(const Graph& graph) : ForwardingGraph(graph) {}

  std::shared_ptr<const FrameHot> hot(FrameId id) const override {
    ++hot_reads_;
    return ForwardingGraph::hot(id);
  }
  std::size_t hot_reads() const { return hot_reads_; }

 private:
  mutable std::size_t hot_reads_ = 0;
};

}  // namespace relmap
