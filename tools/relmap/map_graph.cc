#include "tools/relmap/map_graph.h"

namespace relmap::cli {

Result<MapGraph> read_map_graph(const std::vector<std::string>& choice, client::Client& client,
                                terminal::Console& console) {
  auto chosen = read_chosen_sessions(choice, client, console);
  if (!chosen.ok()) return chosen.status();
  MapGraph graph;
  graph.chosen = std::move(chosen).value();
  const auto& sessions = graph.chosen.sessions;
  for (const auto& [number, session] : sessions)
    if (session.frames > 0) graph.frames.insert({number, session.first});
  // Of a large map, only the edges of the chosen sessions are read.
  std::set<SessionNumber> listed;
  std::vector<client::EdgeFilter> questions(graph.chosen.all ? 1 : 0);
  if (!graph.chosen.all)
    for (const SessionNumber number : graph.chosen.numbers()) questions.emplace_back().session = number;
  for (const client::EdgeFilter& question : questions) {
    auto edges = client.edges(question);
    if (!edges.ok()) return edges.status();
    for (client::Edge& edge : *edges) {
      if (!sessions.contains(edge.a.session) || !sessions.contains(edge.b.session)) continue;
      if (listed.contains(edge.a.session) || listed.contains(edge.b.session))
        continue;  // listed with that session already
      graph.frames.insert({edge.a, edge.b});
      graph.edges.push_back(std::move(edge));
    }
    listed.insert(question.session);
  }
  return graph;
}

}  // namespace relmap::cli
