// A picture of the map: its graph relaxed into one frame, for the eye.
#include <map>
#include <memory>
#include <ostream>
#include <set>

#include "client/map_picture.h"
#include "tools/relmap/commands.h"
#include "tools/relmap/route_options.h"

namespace relmap::cli {

namespace {

constexpr std::size_t kMaxFrames = 200000;  // beyond it nobody sees anything, and relaxation takes minutes

struct MapOptions {
  std::string out, title = "relmap", query, query_right;
  std::vector<std::string> sessions;
  bool removed = false;
  RouteOptions route;
  ViewOptions camera;
};

struct Graph {
  std::map<SessionNumber, std::string> names;
  std::set<FrameId> frames;
  std::vector<client::Edge> edges;  // between those frames
};

bool in_graph(const client::Edge& edge) { return edge.state == client::EdgeState::kAccepted && edge.carries; }

Result<Graph> read_graph(const MapOptions& options, client::Client& client, Console& console) {
  std::set<SessionNumber> chosen;
  for (const std::string& text : options.sessions) {
    const auto session = find_session(client, console, text);
    if (!session.ok()) return session.status();
    chosen.insert(*session);
  }
  Graph graph;
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
    return {Reason::INVALID_ARGUMENT,
            std::to_string(frames) + " frames are too many for a picture; choose by --session"};
  auto edges = client.edges();
  if (!edges.ok()) return edges.status();
  for (client::Edge& edge : *edges) {
    if (!graph.names.contains(edge.a.session) || !graph.names.contains(edge.b.session)) continue;
    graph.frames.insert({edge.a, edge.b});
    graph.edges.push_back(std::move(edge));
  }
  return graph;
}

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

MapPicture::EdgeKind picture_kind(const client::Edge& edge) {
  if (edge.kind == client::EdgeKind::kOdometry) return MapPicture::EdgeKind::kOdometry;
  if (edge.kind == client::EdgeKind::kPrior) return MapPicture::EdgeKind::kPrior;
  switch (edge.state) {
    case client::EdgeState::kCandidate:
      return MapPicture::EdgeKind::kLoopCandidate;
    case client::EdgeState::kQuarantined:
      return MapPicture::EdgeKind::kLoopQuarantined;
    case client::EdgeState::kRemoved:
      return MapPicture::EdgeKind::kLoopRemoved;
    case client::EdgeState::kAccepted:
      break;
  }
  return MapPicture::EdgeKind::kLoopAccepted;
}

Result<MapPicture> relaxed_picture(const Graph& graph, const MapOptions& options) {
  std::vector<RelaxationEdge> springs;
  for (const client::Edge& edge : graph.edges)
    if (in_graph(edge)) springs.push_back({edge.a, edge.b, edge.T_ab, edge.covariance, relaxation_kind(edge.kind)});
  const auto relaxed = relax({graph.frames.begin(), graph.frames.end()}, springs);
  if (!relaxed.ok()) return relaxed.status();

  MapPicture picture;
  picture.title = options.title;
  picture.session_names = graph.names;
  picture.frames = side_by_side(*relaxed);
  std::size_t loops = 0;
  for (const client::Edge& edge : graph.edges) {
    if (edge.state == client::EdgeState::kRemoved && !options.removed) continue;
    picture.edges.push_back({edge.a, edge.b, picture_kind(edge)});
    if (edge.kind == client::EdgeKind::kLoop && edge.state == client::EdgeState::kAccepted) ++loops;
  }
  picture.subtitle = std::to_string(graph.names.size()) + (graph.names.size() == 1 ? " session, " : " sessions, ") +
                     std::to_string(graph.frames.size()) + " keyframes, " + std::to_string(loops) + " loop closures";
  return picture;
}

Status add_labels_to(MapPicture& picture, client::Client& client) {
  const auto labels = client.labels();
  if (!labels.ok()) return labels.status();
  for (const client::LabelledFrames& label : *labels)
    for (const FrameId frame : label.frames)
      if (picture.session_names.contains(frame.session)) picture.labels.push_back({frame, label.label});
  return {};
}

Status add_route_to(MapPicture& picture, const MapOptions& options, client::Client& client, Console& console) {
  const auto request = make_route_request(client, console, options.route, options.camera);
  if (!request.ok()) return request.status();
  const auto route = client.find_route(*request);
  if (!route.ok()) return route.status();
  picture.route.emplace();
  for (const client::RouteStep& step : route->steps) picture.route->frames.push_back(step.frame);
  const auto* label = std::get_if<std::string>(&request->to);
  picture.route->caption = "route to " + (label ? *label : route->to.to_string()) + ", " + fixed(route->distance_m, 1) +
                           " m, " + duration_text(route->time_s);
  return {};
}

Status add_query_to(MapPicture& picture, const MapOptions& options, client::Client& client, Console& console) {
  const auto view = make_view(client, console, options.query, options.query_right, options.camera);
  if (!view.ok()) return view.status();
  const auto found = client.localise(*view);
  if (!found.ok()) return found.status();
  for (const MapPicture::Frame& frame : picture.frames)
    if (frame.id == found->frame)
      picture.query = MapPicture::Query{frame.T_picture_frame * found->T_frame_view, "where the picture was taken"};
  return {};
}

Status draw(const MapOptions& options, client::Client& client, Console& console) {
  const Console::Aside aside(console);
  const auto graph = read_graph(options, client, console);
  if (!graph.ok()) return graph.status();
  if (graph->frames.empty()) return {Reason::EMPTY_MAP, "there is nothing to draw"};
  auto picture = relaxed_picture(*graph, options);
  if (!picture.ok()) return picture.status();
  Status status = add_labels_to(*picture, client);
  if (status.ok() && !options.route.from.empty()) status = add_route_to(*picture, options, client, console);
  if (status.ok() && !options.query.empty()) status = add_query_to(*picture, options, client, console);
  if (status.ok()) status = write_map_picture(*picture, options.out);
  if (!status.ok()) return status;
  console.err() << options.out << ": " << picture->subtitle << '\n';
  return {};
}

}  // namespace

void add_map(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("map", "draws the map, relaxed for the eye");
  auto options = std::make_shared<MapOptions>();
  command->add_option("--out", options->out, "FILE.svg or FILE.png")->required();
  command->add_option("--title", options->title)->capture_default_str();
  command->add_option("--only", options->sessions, "only these sessions (number or name)");
  command->add_flag("--removed", options->removed, "draw removed loop closures, too");
  auto* query = command->add_option("--query", options->query, "a picture to localise and draw");
  command->add_option("--query-right", options->query_right, "its right eye")->needs(query);
  add_route_options(*command, options->route, false);
  add_view_options(*command, options->camera);
  command->callback([&action, options] {
    action = [options](client::Client& client, Console& console) { return draw(*options, client, console); };
  });
}

}  // namespace relmap::cli
