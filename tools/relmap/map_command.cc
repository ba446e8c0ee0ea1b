// relmap map: draws the shape of the map, each connected part by itself.
#include <algorithm>
#include <memory>
#include <optional>
#include <ostream>

#include "client/map_picture.h"
#include "proto/base/json.h"
#include "tools/relmap/commands.h"
#include "tools/relmap/map_drawing.h"
#include "tools/relmap/picture_output.h"
#include "tools/relmap/route_options.h"

namespace relmap::cli {

namespace {

using client::MapPicture;

struct MapOptions {
  std::string out, title = "relmap", query, query_right, colour = "session";
  std::vector<std::string> sessions;
  bool removed = false, tears = false;
  std::uint32_t width = 2400;  // of a PNG, pixels
  RouteOptions route;
  ViewOptions camera;
};

Result<MapPicture::Route> find_route(const MapOptions& options, client::Client& client, terminal::Console& console) {
  const auto request = make_route_request(client, console, options.route, options.camera);
  if (!request.ok()) return request.status();
  const auto route = client.find_route(*request);
  if (!route.ok()) return route.status();
  MapPicture::Route drawn;
  for (const client::RouteStep& step : route->steps) drawn.frames.push_back(step.frame);
  const auto* label = request->or_to.empty() ? std::get_if<std::string>(&request->to) : nullptr;
  drawn.caption =
      "route to " + (label ? *label : route->to.to_string()) + ", " + fixed(route->distance_m, 1) + " m, " +
      (route->unmeasured.steps > 0 ? "of which " + fixed(route->unmeasured.distance_m, 1) + " m a guess, " : "") +
      terminal::duration_text(route->time_s);
  return drawn;
}

Result<MapPicture::Query> find_query(const MapOptions& options, client::Client& client, terminal::Console& console) {
  const auto view = make_view(client, console, options.query, options.query_right, options.camera);
  if (!view.ok()) return view.status();
  const auto found = client.localise(*view);
  if (!found.ok()) return found.status();
  return MapPicture::Query{found->frame, found->T_frame_view, "where the picture was taken"};
}

void tell_tears(const std::vector<client::Tear>& tears, const std::vector<client::Tear>& strained, std::ostream& err) {
  if (tears.empty())
    err << "no tear: the picture stretches no edge by more than " << fixed(client::kTearSigmas, 0) << " sigmas\n";
  for (std::size_t i = 0; i < std::min(tears.size(), kMaxListed); ++i) err << "tear: " << tears[i].words() << '\n';
  if (tears.size() > kMaxListed) err << count_text(tears.size()) << " tears in all\n";
  for (std::size_t i = 0; i < std::min(strained.size(), kMaxListed); ++i)
    err << "stretched closure: " << strained[i].words() << '\n';
}

void tell(const MapOptions& options, const MapShape& shape, const MapPicture& picture, terminal::Console& console) {
  std::ostream& err = console.err();
  err << options.out << ": " << picture.subtitle;
  if (picture.parts.size() > 1) err << ", in " << picture.parts.size() << " parts that nothing connects";
  err << '\n';
  if (const std::string text = shape_text(shape); !text.empty()) err << text << '\n';
  if (!shape.layout.converged) err << client::kNotConverged << '\n';
  if (picture.mono_sessions > 0) err << not_placed_text(picture.mono_sessions, "drawn") << '\n';
  if (picture.query && !shape.find(picture.query->frame))
    err << "the picture was taken at " << picture.query->frame.to_string() << ", which is not drawn\n";
  if (!console.json) return;
  Json json;
  json.add("out", options.out)
      .add("sessions", shape.chosen.sessions.size())
      .add("keyframes", shape.keyframes())
      .add("points", shape.skeleton.points())
      .add("loopClosures", shape.closures_in_force())
      .add("parts", picture.parts.size())
      .add("monoSessions", picture.mono_sessions)
      .add("converged", shape.layout.converged);
  if (options.tears) json.add("tears", picture.tears.size());
  console.out() << json.text() << '\n';
}

Status draw(const MapOptions& options, client::Client& client, terminal::Console& console) {
  const auto format = client::picture_format(options.out);
  if (!format.ok()) return format.status();
  const terminal::Console::Aside aside(console);
  ShapeChoice choice{options.sessions, options.removed};
  std::optional<MapPicture::Route> route;
  std::optional<MapPicture::Query> query;
  if (!options.route.from.empty()) {
    auto found = find_route(options, client, console);
    if (!found.ok()) return found.status();
    route = std::move(found).value();
    choice.points = corners_of(route->frames);
  }
  if (!options.query.empty()) {
    auto found = find_query(options, client, console);
    if (!found.ok()) return found.status();
    query = std::move(found).value();
    choice.points.push_back(query->frame);
  }
  const auto labels = client.labels();
  if (!labels.ok()) return labels.status();
  for (const client::LabelledFrames& label : *labels)
    choice.points.insert(choice.points.end(), label.frames.begin(), label.frames.end());
  auto shape = read_map_shape(choice, client, console);
  if (!shape.ok()) return shape.status();
  if (Status laid_out = lay_out(*shape); !laid_out.ok()) return laid_out;
  MapPicture picture = picture_of(*shape, *labels);
  picture.title = options.title;
  picture.png_scale = options.width / picture.width;
  picture.query = query;
  if (route) {
    route->frames = drawn_of(*shape, route->frames);
    picture.route = route;
  }
  const std::vector<client::Tear> tears = options.tears ? tears_of(*shape) : std::vector<client::Tear>();
  const std::vector<client::Tear> strained = options.tears ? strained_of(*shape) : std::vector<client::Tear>();
  mark_tears(tears, strained, picture);
  if (options.colour == "time") colour_by_time(*shape, picture);
  if (options.colour == "uncertainty") colour_by_uncertainty(*shape, picture);
  const auto bytes = client::draw_map_picture(picture, *format);
  if (!bytes.ok()) return bytes.status();
  if (Status written = write_output(options.out, *bytes, console); !written.ok()) return written;
  tell(options, *shape, picture, console);
  if (options.tears) tell_tears(tears, strained, console.err());
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
