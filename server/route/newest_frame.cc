#include "server/route/newest_frame.h"

#include <optional>
#include <utility>

namespace relmap::route {

Result<FrameId> newest_frame(const storage::Graph& map, const std::string& robot) {
  const auto rank = [](const storage::Session& session) {
    return std::pair(session.header.camera.is_stereo(), session.last_time_us);
  };
  std::optional<storage::Session> newest;
  map.visit_sessions(0, [&](const storage::Session& session) {
    if (session.header.robot == robot && session.frames > 0 && !storage::is_going(session) &&
        (!newest || rank(session) >= rank(*newest)))
      newest = session;
    return true;
  });
  if (!newest) return {Reason::NO_SUCH_SESSION, "no robot named '" + robot + "' has sent a frame"};
  return FrameId{newest->number, newest->last};
}

}  // namespace relmap::route
