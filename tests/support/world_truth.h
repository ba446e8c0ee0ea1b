// True poses of the frames of several sessions in one world, and the errors of a map's edges.
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
  SE3 off;             // where the edge puts b, as seen from where b is
};

class WorldTruth {
 public:
  // Adds a session, with the poses of its camera in the world by the time since its first frame. Throws if a frame has
  // no pose.
  void add(const storage::Graph& graph, SessionNumber session, const DriveTruth& truth);
  const SE3& pose(FrameId frame) const { return poses_.at(frame); }
  EdgeError error(const storage::Edge& edge) const;

 private:
  std::unordered_map<FrameId, SE3> poses_;
};

// The edges of every kind and state with an end in the session, by their ids.
std::vector<storage::Edge> edges_of(const storage::Graph& graph, SessionNumber session);

// The connected groups of sessions, each as a list.
std::vector<std::vector<SessionNumber>> joined_sessions(const storage::Graph& graph);

// The number of the frame's observations in force whose landmarks have a base for which `is_old` returns true.
std::uint32_t observations_of_old(const storage::Graph& graph, FrameId frame,
                                  const std::function<bool(FrameId)>& is_old);

}  // namespace relmap::testing
