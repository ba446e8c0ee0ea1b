// Where the frames of several sessions really were in one world, and how far a map's edges are off.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <unordered_map>
#include <vector>

#include "storage/graph.h"

namespace relmap::testing {

struct EdgeError {
  double metres = 0, radians = 0;
  bool wrong() const;  // a closure: more than 0.5 m or 10 degrees off
};

class WorldTruth {
 public:
  // Poses of the camera by the time since the session's first frame, ascending. Throws where a frame has none.
  void add(const Graph& graph, SessionNumber session, const std::vector<std::int64_t>& time_us,
           const std::vector<SE3>& T_world_frame);
  const SE3& pose(FrameId frame) const { return poses_.at(frame); }
  EdgeError error(const Edge& edge) const;

 private:
  std::unordered_map<FrameId, SE3> poses_;
};

// Edges of every kind and state that end in a frame of the session, by their ids.
std::vector<Edge> edges_of(const Graph& graph, SessionNumber session);

// Sessions that edges of the graph join, in one list each.
std::vector<std::vector<SessionNumber>> joined_sessions(const Graph& graph);

// How many observations of the frame that hold are of landmarks whose bases `is_old` knows.
std::uint32_t observations_of_old(const Graph& graph, FrameId frame, const std::function<bool(FrameId)>& is_old);

}  // namespace relmap::testing
