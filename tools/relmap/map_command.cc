// relmap map: draws the relaxed graph, each connected part by itself.
#include <memory>
#include <ostream>

#include "client/map_picture.h"
#include "tools/relmap/commands.h"
#include "tools/relmap/relaxed_map.h"
#include "tools/relmap/route_options.h"

namespace relmap::cli {

namespace {

struct MapOptions {
  std::string out, title = "relmap", query, query_right;
  std::vector<std::string> sessions;
  bool removed = false;
  std::uint32_t width = 2400;  // of a PNG, pixels
  RouteOptions route;
  ViewOptions camera;
};

client::MapPicture::EdgeKind picture_kind(const client::Edge& edge) {
  if (edge.kind != client::EdgeKind::kLoop) {
    if (!edge.carried_by.empty()) return client::MapPicture::EdgeKind::kCarriedMotion;
    return edge.unmeasured ? client::MapPicture::EdgeKind::kUnmeasuredMotion : client::MapPicture::EdgeKind::kMotion;
  }
  switch (edge.state) {
    case client::EdgeState::kCandidate:
      return client::MapPicture::EdgeKind::kLoopCandidate;
    case client::EdgeState::kQuarantined:
      return client::MapPicture::EdgeKind::kLoopQuarantined;
    case client::EdgeState::kRemoved:
      return client::MapPicture::EdgeKind::kLoopRemoved;
    case client::EdgeState::kAccepted:
      break;
  }
  return client::MapPicture::EdgeKind::kLoopAccepted;
}

client::MapPicture picture_of(const RelaxedMap& map, const MapOptions& options) {
  client::MapPicture picture;
  picture.title = options.title;
  picture.png_scale = options.width / picture.width;
  picture.session_names = map.graph.names;
  for (const MapPart& part : map.parts) {
    client::MapPicture::Part& drawn = picture.parts.emplace_back();
    drawn.root = part.root;
    for (const PlacedFrame& placed : part.frames) drawn.frames.push_back({placed.frame, placed.T_root_frame});
    for (const MapPart::Label& label : part.labels) picture.labels.push_back({label.frame, label.text});
  }
  std::size_t loops = 0;
  for (const client::Edge& edge : map.graph.edges) {
    if (edge.state == client::EdgeState::kRemoved && !options.removed) continue;
    picture.edges.push_back({edge.a, edge.b, picture_kind(edge)});
    if (edge.kind == client::EdgeKind::kLoop && edge.state == client::EdgeState::kAccepted) ++loops;
  }
  const std::size_t sessions = map.graph.names.size(), frames = map.graph.frames.size();
  picture.subtitle = counted_text(sessions, "session") + ", " + counted_text(frames, "keyframe") + ", " +
                     counted_text(loops, "loop closure");
  picture.mono_sessions = map.graph.mono_sessions;
  return picture;
}

Status add_route_to(client::MapPicture& picture, const MapOptions& options, client::Client& client,
                    terminal::Console& console) {
  const auto request = make_route_request(client, console, options.route, options.camera);
  if (!request.ok()) return request.status();
  const auto route = client.find_route(*request);
  if (!route.ok()) return route.status();
  picture.route.emplace();
  for (const client::RouteStep& step : route->steps) picture.route->frames.push_back(step.frame);
  const auto* label = request->or_to.empty() ? std::get_if<std::string>(&request->to) : nullptr;
  picture.route->caption =
      "route to " + (label ? *label : route->to.to_string()) + ", " + fixed(route->distance_m, 1) + " m, " +
      (route->unmeasured.steps > 0 ? "of which " + fixed(route->unmeasured.distance_m, 1) + " m a guess, " : "") +
      terminal::duration_text(route->time_s);
  return {};
}

Status add_query_to(client::MapPicture& picture, const MapOptions& options, client::Client& client,
                    terminal::Console& console) {
  const auto view = make_view(client, console, options.query, options.query_right, options.camera);
  if (!view.ok()) return view.status();
  const auto found = client.localise(*view);
  if (!found.ok()) return found.status();
  picture.query = client::MapPicture::Query{found->frame, found->T_frame_view, "where the picture was taken"};
  return {};
}

Status draw(const MapOptions& options, client::Client& client, terminal::Console& console) {
  const terminal::Console::Aside aside(console);
  auto graph = read_map_graph(options.sessions, client, console);
  if (!graph.ok()) return graph.status();
  if (graph->frames.empty()) return nothing_to_place(*graph, "draw", "drawn");
  const auto labels = client.labels();
  if (!labels.ok()) return labels.status();
  const auto map = relax_map(std::move(graph).value(), *labels);
  if (!map.ok()) return map.status();
  client::MapPicture picture = picture_of(*map, options);
  Status status;
  if (!options.route.from.empty()) status = add_route_to(picture, options, client, console);
  if (status.ok() && !options.query.empty()) status = add_query_to(picture, options, client, console);
  if (status.ok()) status = client::write_map_picture(picture, options.out);
  if (!status.ok()) return status;
  console.err() << options.out << ": " << picture.subtitle;
  if (map->parts.size() > 1) console.err() << ", in " << map->parts.size() << " parts that nothing connects";
  console.err() << '\n';
  if (const std::string text = contraction_text(*map); !text.empty()) console.err() << text << '\n';
  if (const std::size_t mono = map->graph.mono_sessions; mono > 0)
    console.err() << not_placed_text(mono, "drawn") << '\n';
  if (picture.query && !map->graph.frames.contains(picture.query->frame))
    console.err() << "the picture was taken at " << picture.query->frame.to_string() << ", which is not drawn\n";
  return {};
}

}  // namespace

void add_map(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("map", "draw the map as an SVG or PNG picture");
  auto options = std::make_shared<MapOptions>();
  command->add_option("--out", options->out, "picture to write: FILE.svg or FILE.png")->type_name("FILE")->required();
  command->add_option("--title", options->title, "title above the picture")->capture_default_str();
  command->add_option("--width", options->width, "width of a PNG, pixels")
      ->check(CLI::Range(600, 4800))
      ->capture_default_str();
  command->add_option("--only", options->sessions, "draw only these sessions (number or name)")->type_name("SESSION");
  command->add_flag("--removed", options->removed, "draw also loop closures that were removed");
  auto* query = command->add_option("--query", options->query, "localise this picture, and draw where it was taken")
                    ->type_name("PICTURE");
  command->add_option("--query-right", options->query_right, "the right picture of a pair whose left one is --query")
      ->type_name("PICTURE")
      ->needs(query);
  add_route_options(*command, options->route, false);
  add_view_options(*command, options->camera);
  command->footer(
      "Examples:\n"
      "  relmap map --out map.png\n"
      "  relmap map --out map.svg --from 1:0 --to kitchen --only morning\n"
      "--from and --to draw a route.\n"
      "Mono sessions (photographs) have no scale of their own and are not drawn; the legend counts them.");
  command->callback([&action, options] {
    action = [options](client::Client& client, terminal::Console& console) { return draw(*options, client, console); };
  });
}

}  // namespace relmap::cli
