// Writes a trajectory in the text formats of other tools.
#pragma once

#include <cstdint>
#include <string>

#include "server/route/trajectory.h"

namespace relmap::rpc {

enum class TrajectoryFormat : std::uint8_t { kTum, kKitti };

// TUM: "time tx ty tz qx qy qz qw" after '#' lines that name the session and the frame of the poses; a '#' line before
// a pose says that its step is doubtful. KITTI has no comments: a line holds the upper three rows of the matrix, row by
// row, and the header is empty.
std::string trajectory_header(TrajectoryFormat format, const storage::Session& session);
std::string trajectory_line(TrajectoryFormat format, const route::TrajectoryPose& pose);

}  // namespace relmap::rpc
