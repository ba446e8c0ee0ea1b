#include "tests/support/world_truth.h"

#include <algorithm>
#include <map>
#include <stdexcept>

#include "storage/graph/observers.h"

namespace relmap::testing {

void WorldTruth::add(const storage::Graph& graph, SessionNumber number, const DriveTruth& truth) {
  const storage::Session session = graph.session(number).value();
  for (std::uint32_t i = session.first; session.frames > 0 && i <= session.last; ++i) {
    const FrameId frame{number, i};
    const auto hot = graph.hot(frame);
    if (!hot) continue;
    const auto pose = truth_at(truth, hot->time_us - session.first_time_us);
    if (!pose) throw std::runtime_error("no truth for frame " + frame.to_string());
    poses_[frame] = *pose;
  }
}

EdgeError WorldTruth::error(const storage::Edge& edge) const {
  const SE3 off = (pose(edge.a).inverse() * pose(edge.b)).inverse() * edge.T_ab;
  return {off.t.norm(), rotation_angle(off.R), is_wrong(off), off};
}

std::vector<storage::Edge> edges_of(const storage::Graph& graph, SessionNumber number) {
  std::vector<storage::Edge> edges;
  const storage::Session session = graph.session(number).value();
  for (std::uint32_t i = session.first; session.frames > 0 && i <= session.last; ++i)
    if (const auto hot = graph.hot({number, i})) edges.insert(edges.end(), hot->edges.begin(), hot->edges.end());
  return edges;
}

std::vector<std::vector<SessionNumber>> joined_sessions(const storage::Graph& graph) {
  std::map<SessionNumber, SessionNumber> group;  // the lowest number that it is joined with
  const std::vector<storage::Session> sessions = graph.sessions();
  for (const storage::Session& session : sessions) group[session.number] = session.number;
  for (const storage::Session& session : sessions)
    for (const storage::Edge& edge : edges_of(graph, session.number)) {
      if (!edge.in_graph()) continue;
      const SessionNumber a = group[edge.a.session], b = group[edge.b.session];
      for (auto& [number, lowest] : group)
        if (lowest == std::max(a, b)) lowest = std::min(a, b);
    }
  std::map<SessionNumber, std::vector<SessionNumber>> members;
  for (const auto& [number, lowest] : group) members[lowest].push_back(number);
  std::vector<std::vector<SessionNumber>> result;
  for (auto& [lowest, numbers] : members) result.push_back(std::move(numbers));
  return result;
}

std::uint32_t observations_of_old(const storage::Graph& graph, FrameId frame,
                                  const std::function<bool(FrameId)>& is_old) {
  std::uint32_t old = 0;
  for (const LandmarkId landmark : storage::landmarks_seen(graph, *graph.warm(frame))) old += is_old(landmark.base);
  return old;
}

}  // namespace relmap::testing
