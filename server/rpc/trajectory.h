// The trajectory of one session in one frame: its odometry edges chained from its first keyframe. A picture of the map,
// not the map: what loop closures say across the chain is not in it, and a step that nothing measured is a guess that
// all later poses inherit.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "storage/graph/graph.h"

namespace relmap::rpc {

enum class TrajectoryFormat : std::uint8_t { kTum, kKitti };

struct TrajectoryPose {
  FrameId frame;
  std::shared_ptr<const storage::FrameHot> hot;
  SE3 T_first_frame;  // p_first = T_first_frame p_frame
  // Of `hot`, if nothing measured it (is_unmeasured()) or the robot was carried along it.
  const storage::Edge* doubtful_step = nullptr;
};

// One pose after another; reads as far as it is asked. `graph` must outlive it.
class TrajectoryReader {
 public:
  TrajectoryReader(const storage::Graph& graph, const storage::Session& session);

  // nullopt at the end. DATA_LOSS if the chain of odometry is broken.
  Result<std::optional<TrajectoryPose>> next();

 private:
  const storage::Graph& graph_;
  const FrameId last_;
  std::optional<FrameId> next_;
  FrameId previous_;
  SE3 T_first_previous_;
};

// TUM: "time tx ty tz qx qy qz qw" after '#' lines that name the session and the frame of the poses. KITTI has no
// comments: the upper three rows of the matrix, row by row; header is then empty. A '#' line before a pose says that
// its step is doubtful.
std::string trajectory_header(TrajectoryFormat format, const storage::Session& session);
std::string trajectory_line(TrajectoryFormat format, const TrajectoryPose& pose);

}  // namespace relmap::rpc
