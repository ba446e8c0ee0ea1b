#include "storage/graph/graph.h"

#include <algorithm>

namespace relmap::storage {

Slots<FrameHot> Graph::hot_frames(ChunkId chunk) const {
  Slots<FrameHot> frames;
  for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot) frames[slot] = hot(frame_in(chunk, slot));
  return frames;
}

std::vector<Session> Graph::sessions() const {
  std::vector<Session> all;
  visit_sessions(0, [&](const Session& session) {
    all.push_back(session);
    return true;
  });
  return all;
}

SessionCounts Graph::session_counts() const {
  SessionCounts counts;
  visit_sessions(0, [&](const Session& session) {
    counts.add(session);
    return true;
  });
  return counts;
}

Result<Session> existing_session(const Graph& graph, SessionNumber number) {
  if (auto session = graph.session(number)) return *std::move(session);
  return no_such_session(number);
}

Status no_such_session(SessionNumber number) {
  return {Reason::NO_SUCH_SESSION, "no session " + std::to_string(number)};
}

std::optional<Edge> find_edge(const Graph& graph, EdgeId id) {
  const auto hot = graph.hot(id.frame);
  const Edge* edge = hot ? hot->edge(id) : nullptr;
  return edge ? std::optional<Edge>(*edge) : std::nullopt;
}

std::vector<Neighbour> neighbours(const Graph& graph, FrameId, const FrameHot& hot, Supposed supposed) {
  std::vector<Neighbour> found;
  found.reserve(hot.edges.size() + hot.incoming.size());
  for (const Edge& edge : hot.edges)
    if (supposed.in_graph(edge)) found.push_back({edge.id, edge.a, false});
  for (const EdgeId incoming : hot.incoming) {
    const auto other = graph.hot(incoming.frame);
    const Edge* edge = other ? other->edge(incoming) : nullptr;
    if (edge && supposed.in_graph(*edge)) found.push_back({incoming, edge->b, true});
  }
  std::sort(found.begin(), found.end(), [](const Neighbour& l, const Neighbour& r) { return l.edge < r.edge; });
  return found;
}

std::optional<FrameId> next_in_session(FrameId id, const FrameHot& hot) {
  // Incoming edges are sorted by the newer frame. Of the session's later frames the next one comes first, by its
  // odometry edge.
  const auto next = std::lower_bound(hot.incoming.begin(), hot.incoming.end(), EdgeId{id, 0});
  if (next == hot.incoming.end() || next->ordinal != 0 || next->frame.session != id.session) return std::nullopt;
  return next->frame;
}

}  // namespace relmap::storage
