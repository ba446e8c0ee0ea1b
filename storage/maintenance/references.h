// The references of frames to each other, and what is derived from them (storage/graph/frame.h): checks that they lead
// somewhere, and adds them to the sums of a ChunkTable.
#pragma once

#include <functional>
#include <vector>

#include "storage/graph/local_graph.h"
#include "storage/graph/observers.h"
#include "storage/maintenance/chunk_table.h"
#include "storage/maintenance/frame_check.h"
#include "storage/maintenance/stored_graph.h"

namespace relmap::storage {

// The paths from bases to the frames that see their landmarks.
class SightedPaths {
 public:
  explicit SightedPaths(const Graph& graph) : local_(graph) {}

  // Called for each landmark in force that a frame sees, with the edges of the path from the landmark's base; null if
  // the frame is out of reach or the landmark is not needed.
  using Visit = std::function<void(LandmarkId, const std::vector<EdgeId>*)>;
  void visit(FrameId frame, const FrameWarm& warm, const Visit& visit);

 private:
  LocalGraph local_;
  std::vector<LocalStep> steps_;
  std::vector<EdgeId> edges_;
};

// The references of one frame, except those of its observations.
void add_hot_references(const StoredGraph& graph, ChunkTable& table, FrameId id, const FrameHot& frame,
                        const Complain& complain);
void add_observations(const StoredGraph& graph, ChunkTable& table, SightedPaths& paths, FrameId id,
                      const FrameWarm& frame, const Complain& complain);

// Whether an edge with this support keeps its prior. A prior edge always does.
inline bool needs_prior(const Edge& edge, std::uint32_t support) {
  return edge.kind == EdgeKind::kPrior || support < kMinSupport;
}

}  // namespace relmap::storage
