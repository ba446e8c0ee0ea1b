#include "tools/relmap/map_graph.h"

#include "tools/relmap/chosen_sessions.h"

namespace relmap::cli {

std::vector<SessionNumber> MapGraph::sessions() const {
  std::vector<SessionNumber> numbers;
  for (const auto& [number, name] : names) numbers.push_back(number);
  return numbers;
}

Result<MapGraph> read_map_graph(const std::vector<std::string>& choice, client::Client& client,
                                terminal::Console& console) {
  const auto chosen = read_chosen_sessions(choice, client, console);
  if (!chosen.ok()) return chosen.status();
  MapGraph graph;
  graph.mono_sessions = chosen->mono_sessions;
  for (const auto& [number, session] : chosen->sessions) {
    graph.names[number] = session.name;
    graph.cameras[number] = session.camera;
    if (session.frames > 0) graph.frames.insert({number, session.first});
  }
  // Of a large map, only the edges of the chosen sessions are read.
  std::set<SessionNumber> listed;
  std::vector<client::EdgeFilter> questions(chosen->all ? 1 : 0);
  if (!chosen->all)
    for (const SessionNumber number : graph.sessions()) questions.emplace_back().session = number;
  for (const client::EdgeFilter& question : questions) {
    auto edges = client.edges(question);
    if (!edges.ok()) return edges.status();
    for (client::Edge& edge : *edges) {
      if (!graph.names.contains(edge.a.session) || !graph.names.contains(edge.b.session)) continue;
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
