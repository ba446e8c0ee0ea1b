// The trajectory of one session in one coordinate frame: its odometry edges chained from its first keyframe. It is only
// a projection of the map: transforms of loop closures do not enter it, and the error of a step that no sensor measured
// affects all later poses.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "storage/graph/graph.h"

namespace relmap::route {

struct TrajectoryPose {
  FrameId frame;
  std::shared_ptr<const storage::FrameHot> hot;
  SE3 T_first_frame;  // p_first = T_first_frame p_frame
  // The edge to this frame, an edge of `hot`, if no sensor measured it (is_unmeasured()) or the robot was carried along
  // it; otherwise null.
  const storage::Edge* doubtful_step = nullptr;
};

// The sessions with these numbers, ascending and each once. If no numbers are given, all that have a trajectory: those
// of a stereo camera that have not been deleted. NO_SUCH_SESSION; SESSION_DELETED; NOT_STEREO (the motion of a single
// camera has no metres, so a mono session has no odometry edges).
Result<std::vector<storage::Session>> sessions_with_trajectory(const storage::Graph& graph,
                                                               std::vector<SessionNumber> numbers);

// The slots of the landmarks of the pose's frame that show where something is: their depth is measured, and they are in
// force, so that each point is a landmark of one frame only.
std::vector<std::uint32_t> shown_landmarks(const storage::Graph& graph, const TrajectoryPose& pose);

// Reads one pose after another, each when it is asked for. `graph` must outlive it.
class TrajectoryReader {
 public:
  TrajectoryReader(const storage::Graph& graph, const storage::Session& session);

  // The next pose; nullopt at the end. DATA_LOSS if the chain of odometry is broken.
  Result<std::optional<TrajectoryPose>> next();

 private:
  const storage::Graph& graph_;
  const FrameId last_;
  std::optional<FrameId> next_;
  FrameId previous_;
  SE3 T_first_previous_;
};

}  // namespace relmap::route
