#include <cmath>
#include <cstdlib>
#include <iterator>
#include <memory>

#include "tools/relmap/commands.h"
#include "tools/relmap/edge_words.h"
#include "tools/relmap/route_options.h"
#include "tools/relmap/route_views.h"
#include "tools/relmap/typed_text.h"

namespace relmap::cli {

namespace {

// Of the frames that are passed: "hall, kitchen"; "none".
std::string labels_text(const std::vector<client::RouteStep>& steps) {
  std::string passed;
  for (const client::RouteStep& step : steps)
    for (const std::string& label : step.labels) passed += (passed.empty() ? "" : ", ") + label;
  return passed.empty() ? "none" : passed;
}

void print_steps(const client::Route& route, bool covariance, terminal::Console& console) {
  std::vector<std::vector<std::string>> rows;
  for (const client::RouteStep& step : route.steps) {
    std::string labels;
    for (const std::string& label : step.labels) labels += (labels.empty() ? "" : ", ") + label;
    rows.push_back({step.frame.to_string(), fixed(step.distance_m, 2), fixed(step.time_s, 1),
                    step.edge ? step.edge->to_string() : "",
                    step.edge ? std::string(name_of(step.kind)) + (step.long_loop ? ", > 5 m" : "") +
                                    (step.carried ? ", carried" : "") + (step.unmeasured ? ", not measured" : "")
                              : "",
                    labels});
    if (!covariance) continue;
    const Vector6 variance = step.covariance.diagonal();
    rows.back().push_back(fixed(std::sqrt(variance.head<3>().sum()), 3));
    rows.back().push_back(fixed(std::sqrt(variance.tail<3>().sum()) * 180 / M_PI, 2));
  }
  std::vector<std::string> heads{"frame", ">metres", ">seconds", "by edge", "kind", "labels"};
  if (covariance) heads.insert(heads.end(), {">sigma, m", ">degrees"});
  console.table(heads, rows);
}

std::string searched_text(const client::Route& route, double max_cost) {
  const bool cells = route.frame_by_frame.empty();
  const std::string how = cells ? "by cells" : "frame by frame: " + route.frame_by_frame;
  if (route.no_way_by_edges)
    return how + (cells ? ", and" : ";") + " around the start with closures that only bind landmarks, since edges " +
           (max_cost > 0 ? "lead to no goal within --max-cost" : "lead to no goal");
  if (!cells) return how;
  return how + (route.bound_closures ? ", and with closures that only bind landmarks, since it is short"
                                     : ", without closures that only bind landmarks");
}

void print(const client::Route& route, const RouteOptions& asked, terminal::Console& console) {
  std::size_t loops = 0;
  const bool weighed = !asked.weights.empty();
  for (const client::RouteStep& step : route.steps)
    if (step.edge && step.kind == client::EdgeKind::kLoop) ++loops;
  std::vector<std::pair<std::string, std::string>> facts{
      {"from", route.from.to_string() + (route.from_view ? " (by its picture)" : "")},
      {"to", route.to.to_string() + (route.to_view ? " (by its picture)" : "")},
      {"length", fixed(route.distance_m, 2) + " m"},
      {"time", terminal::duration_text(route.time_s)},
      {"by", weighed                   ? "weights, cost " + fixed(route.cost, 3)
             : asked.by == "certainty" ? "variance: " + fixed(1e4 * route.cost, 2) + " cm2"
                                       : asked.by},
      {"frames", count_text(route.steps.size())},
      {"loop edges", count_text(loops) + (route.long_loops ? ", of which " + count_text(route.long_loops) +
                                                                 " longer than 5 m: passable by assumption only"
                                                           : "")},
      {"labels passed", labels_text(route.steps)},
      {"searched", searched_text(route, asked.max_cost)}};
  if (const std::string text = unmeasured_text(route.unmeasured, route.distance_m); !text.empty())
    facts.emplace(facts.begin(), "not measured", text);
  if (const std::string text = carried_text(route.carried); !text.empty()) facts.emplace_back("carried", text);
  console.facts(facts);
}

void print_alternatives(const client::Route& route, terminal::Console& console) {
  std::vector<std::vector<std::string>> rows;
  for (const client::Route& other : route.alternatives)
    rows.push_back({std::to_string(rows.size() + 1), fixed(other.distance_m, 2), terminal::duration_text(other.time_s),
                    fixed(route.cost > 0 ? 100 * (other.cost / route.cost - 1) : 0, 0) + " %",
                    fixed(100 * other.shared, 0) + " %", count_text(other.steps.size()), labels_text(other.steps)});
  console.out() << '\n';
  console.table({"alternative", ">metres", ">time", ">dearer by", ">shared", ">frames", "labels"}, rows);
}

Result<client::RouteWeights> parse_weights(const std::vector<std::string>& texts) {
  client::RouteWeights weights;
  for (const std::string& text : texts) {
    const std::size_t equals = text.find('=');
    const std::string name = text.substr(0, equals);
    double* weight = name == "metre"      ? &weights.metre
                     : name == "second"   ? &weights.driven_second
                     : name == "standing" ? &weights.standing_second
                     : name == "variance" ? &weights.square_metre_of_variance
                                          : nullptr;
    char* end = nullptr;
    const double value = equals == std::string::npos ? -1 : std::strtod(text.c_str() + equals + 1, &end);
    if (!weight || !end || *end != 0 || end == text.c_str() + equals + 1 || !(value >= 0))
      return {Reason::INVALID_ARGUMENT,
              "'" + text + "' is no weight; a weight is metre=N, second=N, standing=N or variance=N, with N >= 0"};
    *weight = value;
  }
  return weights;
}

}  // namespace

void add_route_options(CLI::App& command, RouteOptions& options, bool required) {
  const char* end =
      "a frame (session:index), a label, a picture (.png, .jpg) or robot:NAME (where that robot is now); label:TEXT "
      "and "
      "picture:FILE tell apart what could be both; may be given again: the best of them is used";
  auto* from =
      command.add_option("--from", options.from, end)->type_name("FRAME|LABEL|PICTURE")->allow_extra_args(false);
  auto* to = command.add_option("--to", options.to, end)
                 ->type_name("FRAME|LABEL|PICTURE")
                 ->allow_extra_args(false)
                 ->needs(from);
  from->needs(to);
  if (required) from->required(), to->required();
  auto* by =
      command
          .add_option("--by", options.by,
                      "what is minimised: distance, time, or certainty (the variance of the transform along the route)")
          ->check(CLI::IsMember({"distance", "time", "certainty"}))
          ->capture_default_str();
  auto* standing =
      command.add_flag("--standing", options.standing, "with --by time: count also the time that robots stood still");
  command
      .add_option(
          "--weigh", options.weights,
          "minimise a weighted sum instead: metre=1, second=0.5 (of driving), standing=0.1 (a second of standing), "
          "variance=30 (a square metre)")
      ->type_name("UNIT=WEIGHT")
      ->check(parsed_by([](const std::string& text) { return parse_weights({text}); }))
      ->allow_extra_args(false)
      ->delimiter(',')
      ->excludes(by)
      ->excludes(standing);
  command
      .add_option("--max-cost", options.max_cost, "give up beyond this cost: metres, seconds, or the unit of --weigh")
      ->check(CLI::NonNegativeNumber);
  command.add_option("--only-session", options.sessions, "pass only frames of this session; may be given again")
      ->type_name("SESSION")
      ->allow_extra_args(false);
  command
      .add_option("--avoid", options.avoid, "do not pass this frame, or the frames of this label; may be given again")
      ->type_name("FRAME|LABEL")
      ->allow_extra_args(false);
  command.add_option("--min-support", options.min_support,
                     "use only edges with at least so many observations across them");
  command.add_flag("--no-long-loops", options.no_long_loops,
                   "use no loop edge longer than 5 m: nobody drove it, so it is passable by assumption only");
  command
      .add_option("--suppose", options.suppose,
                  "treat closures in this state as if they were in force: candidate or quarantined")
      ->allow_extra_args(false)
      ->check(CLI::IsMember({"candidate", "quarantined"}));
}

namespace {

Result<std::vector<client::RouteEnd>> make_ends(client::Client& client, terminal::Console& console,
                                                const std::vector<std::string>& texts, const ViewOptions& camera) {
  std::vector<client::RouteEnd> ends;
  for (const std::string& text : texts) {
    auto end = make_route_end(client, console, text, camera);
    if (!end.ok()) return end.status();
    ends.push_back(std::move(end).value());
  }
  return ends;
}

}  // namespace

Result<client::RouteRequest> make_route_request(client::Client& client, terminal::Console& console,
                                                const RouteOptions& options, const ViewOptions& camera) {
  auto from = make_ends(client, console, options.from, camera);
  if (!from.ok()) return from.status();
  auto to = make_ends(client, console, options.to, camera);
  if (!to.ok()) return to.status();
  client::RouteRequest request{.from = from->front(), .to = to->front()};
  request.or_from.assign(std::next(from->begin()), from->end());
  request.or_to.assign(std::next(to->begin()), to->end());
  request.by = options.by == "time"        ? client::RouteBy::kTime
               : options.by == "certainty" ? client::RouteBy::kCertainty
                                           : client::RouteBy::kDistance;
  request.count_standing = options.standing;
  if (!options.weights.empty()) {
    const auto weights = parse_weights(options.weights);
    if (!weights.ok()) return weights.status();
    request.weights = *weights;
  }
  request.max_cost = options.max_cost;
  for (const std::string& text : options.sessions) {
    const auto session = find_session(client, console, text);
    if (!session.ok()) return session.status();
    request.filter.sessions.push_back(*session);
  }
  for (const std::string& text : options.avoid)
    if (const auto frame = FrameId::parse(text))
      request.filter.avoid_frames.push_back(*frame);
    else
      request.filter.avoid_labels.push_back(text.starts_with("label:") ? text.substr(6) : text);
  request.filter.min_support = options.min_support;
  request.filter.long_loops = !options.no_long_loops;
  for (const std::string& state : options.suppose)
    (state == "candidate" ? request.filter.suppose_candidates : request.filter.suppose_quarantined) = true;
  request.covariance = options.covariance;
  request.alternatives = options.alternatives;
  return request;
}

void add_route(CLI::App& app, Action& action) {
  struct Asked {
    RouteOptions route;
    ViewOptions camera;
    bool steps = false;
    std::string out;
    std::size_t stops = 12;
  };
  auto* command = app.add_subcommand("route", "find the shortest, quickest or most certain route");
  auto asked = std::make_shared<Asked>();
  add_route_options(*command, asked->route, true);
  add_view_options(*command, asked->camera);
  auto* steps = command->add_flag("--steps", asked->steps, "print every frame of the route");
  command
      ->add_flag("--covariance", asked->route.covariance,
                 "print for each step how well its pose relative to the start is known")
      ->needs(steps);
  command
      ->add_option("--alternatives", asked->route.alternatives,
                   "find so many other routes, too: each at most 1.5 times as dear, a quarter of it apart from those "
                   "before it; there may be fewer")
      ->check(CLI::Range(0, 5));
  auto* const out =
      command
          ->add_option("--out", asked->out,
                       "draw what the route passes, and below it how well the position relative to the start is known: "
                       "FILE.png or FILE.svg")
          ->type_name("FILE");
  command->add_option("--stops", asked->stops, "with --out: the number of views along the way")
      ->check(CLI::Range(2, 48))
      ->capture_default_str()
      ->needs(out);
  command->footer(
      "Examples:\n"
      "  relmap route --from 3:120 --to kitchen --out strip.png --alternatives 2\n"
      "  relmap route --from 3:120 --to kitchen\n"
      "  relmap route --from robot:anna --to dock --to charger --by time --standing\n"
      "  relmap route --from photo.jpg --to 5:77 --weigh metre=1,second=0.5 --avoid lift --no-long-loops\n"
      "Loop closures that only bind landmarks are no edges of the graph. A route may take them nevertheless if the "
      "daemon\n"
      "searches frame by frame, or if the route is short (50 steps, or edges lead to no goal) and its goal is among "
      "the\n"
      "2,000 frames nearest to the start. All other routes by cells follow edges only.");
  command->callback([&action, asked] {
    action = [asked](client::Client& client, terminal::Console& console) -> Status {
      auto request = make_route_request(client, console, asked->route, asked->camera);
      if (!request.ok()) return request.status();
      if (!asked->out.empty()) request->covariance = true;
      const auto route = client.find_route(*request);
      if (!route.ok()) return route.status();
      if (!asked->out.empty())
        if (Status status = write_route_strip(*route, asked->stops, asked->out, client, console); !status.ok())
          return status;
      if (console.json) return {};
      asked->steps ? print_steps(*route, asked->route.covariance, console) : print(*route, asked->route, console);
      if (!route->alternatives.empty()) print_alternatives(*route, console);
      return {};
    };
  });
}

}  // namespace relmap::cli
