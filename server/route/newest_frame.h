// The frame at which a route begins or ends if only a robot is named for it.
#pragma once

#include <string>

#include "storage/graph/graph.h"

namespace relmap::route {

// The newest frame of the robot's sessions, but for those that are being deleted. A frame of a stereo session is
// preferred to any of a mono session, which has no edges. NO_SUCH_SESSION if the map holds no frame of the robot.
Result<FrameId> newest_frame(const storage::Graph& map, const std::string& robot);

}  // namespace relmap::route
