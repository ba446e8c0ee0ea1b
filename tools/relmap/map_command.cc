// relmap map: draws the relaxed graph, each connected part by itself.
#include <algorithm>
#include <memory>
#include <ostream>

#include "client/map_picture.h"
#include "tools/relmap/commands.h"
#include "tools/relmap/map_drawing.h"
#include "tools/relmap/picture_output.h"
#include "tools/relmap/relaxed_map.h"
#include "tools/relmap/route_options.h"

namespace relmap::cli {

namespace {

struct MapOptions {
  std::string out, title = "relmap", query, query_right, colour = "session";
  std::vector<std::string> sessions;
  bool removed = false, tears = false;
  std::uint32_t width = 2400;  // of a PNG, pixels
  RouteOptions route;
  ViewOptions camera;
};

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

void tell_tears(const RelaxedMap& map, terminal::Console& console) {
  std::size_t tears = 0;
  for (const MapPart& part : map.parts) tears += part.tears.size();
  if (tears == 0)
    console.err() << "no tear: the picture stretches no edge by more than " << fixed(kTearSigmas, 0) << " sigmas\n";
  for (const MapPart& part : map.parts)
    for (std::size_t i = 0; i < std::min(part.tears.size(), kMaxListed); ++i)
      console.err() << "tear: " << part.tears[i].words() << '\n';
  if (tears > kMaxListed) console.err() << count_text(tears) << " tears in all\n";
  for (std::size_t i = 0; i < std::min(map.strained.size(), kMaxListed); ++i)
    console.err() << "stretched closure: " << map.strained[i].words() << '\n';
}

Status draw(const MapOptions& options, client::Client& client, terminal::Console& console) {
  const auto format = client::picture_format(options.out);
  if (!format.ok()) return format.status();
  const terminal::Console::Aside aside(console);
  auto graph = read_map_graph(options.sessions, client, console);
  if (!graph.ok()) return graph.status();
  if (graph->frames.empty()) return nothing_to_place(*graph, "draw", "drawn");
  const auto labels = client.labels();
  if (!labels.ok()) return labels.status();
  const auto map = relax_map(std::move(graph).value(), *labels);
  if (!map.ok()) return map.status();
  client::MapPicture picture = picture_of(*map, options.removed);
  picture.title = options.title;
  picture.png_scale = options.width / picture.width;
  if (options.tears) mark_tears(*map, picture);
  if (options.colour == "time") colour_by_time(*map, picture);
  if (options.colour == "uncertainty") colour_by_uncertainty(*map, picture);
  Status status;
  if (!options.route.from.empty()) status = add_route_to(picture, options, client, console);
  if (status.ok() && !options.query.empty()) status = add_query_to(picture, options, client, console);
  if (!status.ok()) return status;
  const auto bytes = client::draw_map_picture(picture, *format);
  if (!bytes.ok()) return bytes.status();
  if (Status written = write_output(options.out, *bytes, console); !written.ok()) return written;
  console.err() << options.out << ": " << picture.subtitle;
  if (map->parts.size() > 1) console.err() << ", in " << map->parts.size() << " parts that nothing connects";
  console.err() << '\n';
  if (const std::size_t mono = map->graph.mono_sessions; mono > 0)
    console.err() << not_placed_text(mono, "drawn") << '\n';
  if (options.tears) tell_tears(*map, console);
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
  command
      ->add_option("--colour", options->colour,
                   "what colours tell: the session, when it was driven, or how well the position relative to the frame "
                   "of reference is known")
      ->check(CLI::IsMember({"session", "time", "uncertainty"}))
      ->capture_default_str();
  command->add_flag("--tears", options->tears,
                    "mark edges that the picture had to stretch by more than 6 sigmas, and list the closures that it "
                    "stretches most: measurements contradict each other there");
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
      "  relmap map --out map.png --tears --colour uncertainty\n"
      "--from and --to draw a route.\n"
      "Mono sessions (photographs) have no scale of their own and are not drawn; the legend counts them.");
  command->callback([&action, options] {
    action = [options](client::Client& client, terminal::Console& console) { return draw(*options, client, console); };
  });
}

}  // namespace relmap::cli
