// What a search over a large part of the map remembers: for each frame that it settled, the edge by which it was
// reached. This is one code a frame, in arrays by chunk, so that a search through a million frames holds 3 MB. The
// resulting path takes two bytes a step and can be walked any number of times.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <set>
#include <unordered_map>
#include <vector>

#include "server/route/edge_access.h"
#include "server/route/work_limit.h"
#include "storage/graph/chunk.h"
#include "storage/graph/graph.h"

namespace relmap::route {

// A path from `from` to `to`. `turns` holds, last step first, the index of the next frame among the neighbours() of
// each frame. The path is valid only for the graph on which it was found and with the same `supposed`; for a MapView,
// that is as long as the view is held.
struct Path {
  FrameId from, to;
  std::vector<std::uint16_t> turns;
  storage::Supposed supposed;

  std::size_t memory_bytes() const { return turns.capacity() * sizeof(turns[0]); }
};

class Trail {
 public:
  explicit Trail(storage::Supposed supposed = {}) : supposed_(supposed) {}

  bool contains(FrameId frame) const { return arrival(frame) != kNever; }
  // `steps` are the neighbours() of the frame; `edge` is the one by which it was reached, invalid for a start.
  void settle(FrameId frame, const std::vector<storage::Neighbour>& steps, EdgeId edge);

  std::size_t frames() const { return frames_; }
  std::set<SessionNumber> sessions() const;
  std::size_t memory_bytes() const;

  // Returns the path from the start to a settled frame. Calls `visit` with each edge, beginning at the goal. Ends early
  // with what work.proceed returns.
  using Visitor = std::function<void(const storage::Edge& edge)>;
  Result<Path> trace(const storage::Graph& graph, FrameId goal, const WorkLimit& work, const Visitor& visit) const;

 private:
  // Codes: never settled, a start, or 2 + the index of the previous frame among the frame's own neighbours.
  static constexpr std::uint16_t kNever = 0, kStart = 1, kFirst = 2;
  std::uint16_t arrival(FrameId frame) const;

  storage::Supposed supposed_;
  std::unordered_map<storage::ChunkId, std::array<std::uint16_t, storage::kFramesPerChunk>> chunks_;
  std::size_t frames_ = 0;
};

// Walks a path from its start. Throws StatusError where reads of the graph do.
class PathWalk {
 public:
  // Graph and path must outlive the walk.
  PathWalk(const storage::Graph& graph, const Path& path) : graph_(graph), path_(path), frame_(path.from) {}

  struct Step {
    FrameId frame;
    std::shared_ptr<const storage::FrameHot> hot;
    std::optional<EdgeRef> edge;  // the edge to the next frame; none at the last
    bool forward = false;         // walked from Edge::a to Edge::b
  };
  // The next step; nullopt after the last.
  std::optional<Step> next();

 private:
  const storage::Graph& graph_;
  const Path& path_;
  std::size_t taken_ = 0;
  FrameId frame_;
};

}  // namespace relmap::route
