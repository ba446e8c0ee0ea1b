#include "server/route/trajectory.h"

#include "storage/graph/frame.h"

namespace relmap::route {

TrajectoryReader::TrajectoryReader(const storage::Graph& graph, const storage::Session& session)
    : graph_(graph), last_{session.number, session.last} {
  if (session.frames > 0) next_ = FrameId{session.number, session.first};
}

Result<std::optional<TrajectoryPose>> TrajectoryReader::next() {
  if (!next_) return std::optional<TrajectoryPose>();
  const FrameId id = *next_;
  const auto hot = graph_.hot(id);
  if (!hot) return {Reason::DATA_LOSS, "frame " + id.to_string() + " is missing"};
  SE3 T_first_this;
  const storage::Edge* step = nullptr;
  if (previous_.valid()) {
    step = hot->edge({id, 0});
    if (!step || step->a != previous_)
      return {Reason::DATA_LOSS, "no odometry edge from " + previous_.to_string() + " to " + id.to_string()};
    T_first_this = (T_first_previous_ * step->T_ab).normalized();
  }
  next_ = storage::next_in_session(id, *hot);
  if (!next_ && id != last_)
    return {Reason::DATA_LOSS,
            "no edge leads on from frame " + id.to_string() + ", but the session ends with frame " + last_.to_string()};
  previous_ = id;
  T_first_previous_ = T_first_this;
  const bool doubtful = step && (storage::is_unmeasured(*step) || !step->carried_by.empty());
  return std::optional(TrajectoryPose{id, hot, T_first_this, doubtful ? step : nullptr});
}

}  // namespace relmap::route
