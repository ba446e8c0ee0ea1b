#include "tools/relmap/map_graph.h"

#include "tools/relmap/view_options.h"

namespace relmap::cli {

namespace {

constexpr std::size_t kMaxFrames = 200000;  // beyond it nobody sees anything, and relaxation takes minutes

RelaxationEdgeKind relaxation_kind(client::EdgeKind kind) {
  switch (kind) {
    case client::EdgeKind::kLoop:
      return RelaxationEdgeKind::kLoop;
    case client::EdgeKind::kPrior:
      return RelaxationEdgeKind::kPrior;
    case client::EdgeKind::kOdometry:
      break;
  }
  return RelaxationEdgeKind::kOdometry;
}

}  // namespace

Result<MapGraph> read_map_graph(const std::vector<std::string>& names, client::Client& client, Console& console) {
  std::set<SessionNumber> chosen;
  for (const std::string& text : names) {
    const auto session = find_session(client, console, text);
    if (!session.ok()) return session.status();
    chosen.insert(*session);
  }
  MapGraph graph;
  const auto sessions = client.sessions();
  if (!sessions.ok()) return sessions.status();
  std::size_t frames = 0;
  for (const client::Session& session : *sessions) {
    if (!chosen.empty() && !chosen.contains(session.number)) continue;
    graph.names[session.number] = session.name;
    frames += session.frames;
    if (session.frames > 0) graph.frames.insert({session.number, session.first});
  }
  if (frames > kMaxFrames)
    return {Reason::INVALID_ARGUMENT, std::to_string(frames) + " frames are too many to be relaxed (" +
                                          std::to_string(kMaxFrames) + " at most); choose sessions"};
  auto edges = client.edges();
  if (!edges.ok()) return edges.status();
  for (client::Edge& edge : *edges) {
    if (!graph.names.contains(edge.a.session) || !graph.names.contains(edge.b.session)) continue;
    graph.frames.insert({edge.a, edge.b});
    graph.edges.push_back(std::move(edge));
  }
  return graph;
}

Result<Relaxation> relax(const MapGraph& graph) {
  std::vector<RelaxationEdge> springs;
  for (const client::Edge& edge : graph.edges)
    if (in_graph(edge)) springs.push_back({edge.a, edge.b, edge.T_ab, edge.covariance, relaxation_kind(edge.kind)});
  return relmap::relax({graph.frames.begin(), graph.frames.end()}, springs);
}

}  // namespace relmap::cli
