// Where the frames of several sessions really were in one world, and how far a map's edges are off.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <unordered_map>
#include <vector>

#include "storage/graph/graph.h"
#include "tests/support/drive_evaluation.h"

namespace relmap::testing {

struct EdgeError {
  double metres = 0, radians = 0;
  bool wrong = false;  // for a closure: is_wrong()
};

class WorldTruth {
 public:
  // Poses of the camera in the world, by the time since the session's first frame. Throws where a frame has none.
  void add(const storage::Graph& graph, SessionNumber session, const DriveTruth& truth);
  const SE3& pose(FrameId frame) const { return poses_.at(frame); }
  EdgeError error(const storage::Edge& edge) const;

 private:
  std::unordered_map<FrameId, SE3> poses_;
};

// Edges of every kind and state that end in a frame of the session, by their ids.
std::vector<storage::Edge> edges_of(const storage::Graph& graph, SessionNumber session);

// Sessions that edges of the graph join, in one list each.
std::vector<std::vector<SessionNumber>> joined_sessions(const storage::Graph& graph);

// How many observations of the frame that hold are of landmarks whose bases `is_old` knows.
std::uint32_t observations_of_old(const storage::Graph& graph, FrameId frame,
                                  const std::function<bool(FrameId)>& is_old);

}  // namespace relmap::testing
