#include "tools/relmap/map_graph.h"

#include "proto/base/number_text.h"
#include "tools/relmap/view_options.h"

namespace relmap::cli {

std::vector<SessionNumber> MapGraph::sessions() const {
  std::vector<SessionNumber> numbers;
  for (const auto& [number, name] : names) numbers.push_back(number);
  return numbers;
}

std::string not_placed_text(std::size_t mono_sessions, const std::string& done) {
  const bool one = mono_sessions == 1;
  return counted_text(mono_sessions, "mono session") + " (photographs) " +
         (one ? "has no scale of its own and is" : "have no scale of their own and are") + " not " + done;
}

Status nothing_to_place(const MapGraph& graph, const std::string& verb, const std::string& done) {
  std::string text = "there is nothing to " + verb;
  if (graph.mono_sessions > 0) text += ": " + not_placed_text(graph.mono_sessions, done);
  return {Reason::EMPTY_MAP, text};
}

Result<MapGraph> read_map_graph(const std::vector<std::string>& choice, client::Client& client,
                                terminal::Console& console) {
  std::set<SessionNumber> chosen;
  for (const std::string& text : choice) {
    const auto session = find_session(client, console, text);
    if (!session.ok()) return session.status();
    chosen.insert(*session);
  }
  MapGraph graph;
  const auto sessions = client.sessions();
  if (!sessions.ok()) return sessions.status();
  std::set<SessionNumber> missing = chosen;
  for (const client::Session& session : *sessions) {
    if (!chosen.empty() && !chosen.contains(session.number)) continue;
    missing.erase(session.number);
    if (!session.camera.is_stereo()) {
      if (chosen.empty()) {
        if (session.frames > 0) ++graph.mono_sessions;
        continue;
      }
      return {Reason::NOT_STEREO,
              "session " + std::to_string(session.number) + " is a mono session: nothing connects its frames"};
    }
    graph.names[session.number] = session.name;
    graph.cameras[session.number] = session.camera;
    graph.sessions_by_number[session.number] = session;
    if (session.frames > 0) graph.frames.insert({session.number, session.first});
  }
  if (!missing.empty()) return {Reason::NO_SUCH_SESSION, "no session " + std::to_string(*missing.begin())};
  // Of a large map, only the edges of the chosen sessions are read.
  std::set<SessionNumber> listed;
  std::vector<client::EdgeFilter> questions(chosen.empty() ? 1 : 0);
  for (const SessionNumber number : chosen) questions.emplace_back().session = number;
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
