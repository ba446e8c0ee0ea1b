#include "server/route/trajectory.h"

#include <algorithm>
#include <string>

#include "storage/graph/binding.h"
#include "storage/graph/frame.h"

namespace relmap::route {

Result<std::vector<storage::Session>> sessions_with_trajectory(const storage::Graph& graph,
                                                               std::vector<SessionNumber> numbers) {
  std::vector<storage::Session> sessions;
  if (numbers.empty()) {
    graph.visit_sessions(0, [&](const storage::Session& session) {
      if (session.header.camera.is_stereo() && !storage::is_deleted(session)) sessions.push_back(session);
      return true;
    });
    return sessions;
  }
  std::sort(numbers.begin(), numbers.end());
  numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
  for (const SessionNumber number : numbers) {
    auto session = storage::existing_session(graph, number);
    if (!session.ok()) return session.status();
    if (storage::is_deleted(*session))
      return {Reason::SESSION_DELETED, "session " + std::to_string(number) + " was deleted"};
    if (!session->header.camera.is_stereo())
      return {Reason::NOT_STEREO, "session " + std::to_string(number) + " is a mono session and has no trajectory"};
    sessions.push_back(std::move(session).value());
  }
  return sessions;
}

std::vector<std::uint32_t> shown_landmarks(const storage::Graph& graph, const TrajectoryPose& pose) {
  std::vector<std::uint32_t> shown;
  for (std::uint32_t slot = 0; slot < pose.hot->landmarks.size(); ++slot) {
    const LandmarkId id{pose.frame, slot};
    if (!pose.hot->landmarks[slot].depth_prior && storage::resolve(graph, id) == id) shown.push_back(slot);
  }
  return shown;
}

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
