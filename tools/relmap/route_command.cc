#include <memory>

#include "tools/relmap/commands.h"
#include "tools/relmap/route_options.h"

namespace relmap::cli {

namespace {

void print_steps(const client::Route& route, Console& console) {
  std::vector<std::vector<std::string>> rows;
  for (const client::RouteStep& step : route.steps) {
    std::string labels;
    for (const std::string& label : step.labels) labels += (labels.empty() ? "" : ", ") + label;
    rows.push_back({step.frame.to_string(), fixed(step.distance_m, 2), fixed(step.time_s, 1),
                    step.edge ? step.edge->to_string() : "", step.edge ? name_of(step.kind) : "", labels});
  }
  console.table({"frame", ">metres", ">seconds", "by edge", "kind", "labels"}, rows);
}

void print(const client::Route& route, Console& console) {
  std::string passed;
  std::size_t loops = 0;
  for (const client::RouteStep& step : route.steps) {
    for (const std::string& label : step.labels) passed += (passed.empty() ? "" : ", ") + label;
    if (step.edge && step.kind == client::EdgeKind::kLoop) ++loops;
  }
  console.facts(
      {{"from", route.from.to_string() + (route.from_view ? " (by its picture)" : "")},
       {"to", route.to.to_string() + (route.to_view ? " (by its picture)" : "")},
       {"length", fixed(route.distance_m, 2) + " m"},
       {"time", duration_text(route.time_s)},
       {"frames", std::to_string(route.steps.size())},
       {"loop edges", std::to_string(loops) + (route.long_loops ? ", of which " + std::to_string(route.long_loops) +
                                                                      " longer than 5 m: passable by assumption only"
                                                                : "")},
       {"labels passed", passed.empty() ? "none" : passed}});
}

}  // namespace

void add_route_options(CLI::App& command, RouteOptions& options, bool required) {
  const char* end = "frame (session:index), label, or picture";
  auto* from = command.add_option("--from", options.from, end);
  auto* to = command.add_option("--to", options.to, end)->needs(from);
  from->needs(to);
  if (required) from->required(), to->required();
  command.add_option("--by", options.by, "distance or time")
      ->check(CLI::IsMember({"distance", "time"}))
      ->capture_default_str();
  command.add_flag("--standing", options.standing, "by time: count the time that robots stood, too");
  command.add_option("--max-cost", options.max_cost, "give up beyond so many metres or seconds")
      ->check(CLI::NonNegativeNumber);
}

Result<client::RouteRequest> make_route_request(client::Client& client, Console& console, const RouteOptions& options,
                                                const ViewOptions& camera) {
  auto from = make_route_end(client, console, options.from, camera);
  if (!from.ok()) return from.status();
  auto to = make_route_end(client, console, options.to, camera);
  if (!to.ok()) return to.status();
  return client::RouteRequest{std::move(from).value(), std::move(to).value(),
                              options.by == "time" ? client::RouteBy::kTime : client::RouteBy::kDistance,
                              options.standing, options.max_cost};
}

void add_route(CLI::App& app, Action& action) {
  struct Asked {
    RouteOptions route;
    ViewOptions camera;
    bool steps = false;
  };
  auto* command = app.add_subcommand("route", "the shortest or quickest way");
  auto asked = std::make_shared<Asked>();
  add_route_options(*command, asked->route, true);
  add_view_options(*command, asked->camera);
  command->add_flag("--steps", asked->steps, "print every frame on the way");
  command->callback([&action, asked] {
    action = [asked](client::Client& client, Console& console) -> Status {
      const auto request = make_route_request(client, console, asked->route, asked->camera);
      if (!request.ok()) return request.status();
      const auto route = client.find_route(*request);
      if (!route.ok()) return route.status();
      if (console.json) return {};
      asked->steps ? print_steps(*route, console) : print(*route, console);
      return {};
    };
  });
}

}  // namespace relmap::cli
