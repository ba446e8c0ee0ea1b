// The references of frames to each other, and what is derived from them (storage/frame.h): whether they lead anywhere,
// and into the sums of a ChunkTable.
#pragma once

#include "storage/maintenance/chunk_table.h"
#include "storage/maintenance/frame_check.h"
#include "storage/maintenance/stored_graph.h"
#include "storage/path_tree.h"

namespace relmap {

// References of one frame, its observations excepted.
void add_hot_references(const StoredGraph& graph, ChunkTable& table, FrameId id, const FrameHot& frame,
                        const Complain& complain);
void add_observations(const StoredGraph& graph, ChunkTable& table, FrameId id, const FrameWarm& frame,
                      const Complain& complain);

// Adds `times` the paths from a landmark's base to its observers to the support of their edges.
void add_paths(ChunkTable& table, PathSearch& paths, const std::vector<FrameId>& observers, int times);

// The landmarks that a frame's observations mean, each once, ascending.
std::vector<LandmarkId> landmarks_seen(const Graph& graph, const FrameWarm& frame);

// Whether it can be supported at all by what the map stores: a prior edge always keeps its prior.
inline bool needs_prior(const Edge& edge, std::uint32_t support) {
  return edge.kind == EdgeKind::kPrior || support < kMinSupport;
}

}  // namespace relmap
