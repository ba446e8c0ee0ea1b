// Access to the record of an edge that a search is about to walk, without a copy.
#pragma once

#include <memory>

#include "storage/graph/graph.h"

namespace relmap::route {

// A reference to an edge that keeps the frame that stores it alive. The constructors throw StatusError (DATA_LOSS) if
// the edge is missing.
class EdgeRef {
 public:
  // `near`: graph.hot() of the frame from which `step` starts.
  EdgeRef(const storage::Graph& graph, FrameId near_id, const std::shared_ptr<const storage::FrameHot>& near,
          const storage::Neighbour& step)
      : EdgeRef(step.edge.frame == near_id ? near : graph.hot(step.edge.frame), step.edge) {}
  EdgeRef(std::shared_ptr<const storage::FrameHot> owner, EdgeId id)
      : owner_(std::move(owner)), edge_(owner_ ? owner_->edge(id) : nullptr) {
    if (!edge_) throw StatusError(Status(Reason::DATA_LOSS, "edge " + id.to_string() + " is missing from its frame"));
  }

  const storage::Edge& operator*() const { return *edge_; }
  const storage::Edge* operator->() const { return edge_; }

 private:
  std::shared_ptr<const storage::FrameHot> owner_;
  const storage::Edge* edge_;
};

// T_near_far of an edge walked from a to b (forward) or from b to a.
inline SE3 walked(const storage::Edge& edge, bool forward) { return forward ? edge.T_ab : edge.T_ab.inverse(); }

}  // namespace relmap::route
