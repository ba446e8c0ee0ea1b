// A route through a map far larger than memory: what the search holds, and how long it takes.
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <memory>

#include "server/route/dijkstra.h"
#include "storage/map.h"
#include "storage/rocksdb/rocksdb_engine.h"
#include "tools/bench/subcommand.h"

namespace relmap::bench {

namespace {

constexpr std::uint32_t kLandmarks = 12, kObservers = 4;

struct Options {
  std::uint32_t frames = 1'000'000;
  std::size_t memory_budget_mb = 256;
  std::string data = "relmap-bench-routes";
};

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

FrameHot frame_of_drive(std::uint32_t index) {
  FrameHot hot;
  hot.present = true;
  hot.time_us = 1'600'000'000'000'000 + std::int64_t{index} * 500'000;
  if (index > 0) {
    Edge edge;
    edge.id = {{1, index}, 0};
    edge.a = {1, index - 1};
    edge.b = {1, index};
    edge.T_ab.t = {0.01, 0, 0.8 + 0.001 * (index % 100)};
    edge.covariance = 1e-4 * Matrix6::Identity();
    edge.driven_s = 0.5f;
    hot.edges.push_back(edge);
  }
  for (std::uint32_t slot = 0; slot < kLandmarks; ++slot) {
    Landmark landmark;
    landmark.track = {index, slot};
    for (std::uint32_t i = 0; i < kObservers; ++i) landmark.observers.push_back({1, index + i});
    hot.landmarks.push_back(landmark);
  }
  return hot;
}

void drive_on(Map& map, std::uint32_t frames) {
  if (!map.session(1)) {
    Session session;
    session.number = 1;
    session.header.name = "light";
    map.add_session(session);
  }
  for (std::uint32_t i = map.session(1)->next_sequence; i < frames; ++i) {
    map.add_frame({1, i}, frame_of_drive(i), {}, {});
    if (i > 0) map.edit_hot({1, i - 1}).incoming = {{{1, i}, 0}};
    Session& session = map.edit_session(1);
    session.last = i;
    session.next_sequence = i + 1;
    ++session.frames;
    ++map.state().keyframes;
    if (i % 2000 == 1999 || i + 1 == frames)
      if (Status status = map.commit(); !status.ok()) throw StatusError(status);
  }
}

void run(const Options& options, Report& report) {
  auto budget = std::make_shared<Budget>(options.memory_budget_mb << 20);
  RocksDbOptions engine_options;
  engine_options.cache_bytes = budget->allowance(Share::kEngine);
  const auto engine = open_rocksdb(options.data, engine_options).or_throw();
  const auto map = Map::open(engine, engine->acquire().or_throw(), budget).or_throw();
  drive_on(*map, options.frames);

  const auto view = map->view();
  std::size_t most = 0;
  const WorkLimit work{.proceed = [&](std::size_t bytes) {
    most = std::max(most, bytes);
    budget->set(Share::kEngine, engine->memory_bytes());
    return Status();
  }};
  const std::vector<FrameId> from{{1, 0}}, to{{1, options.frames - 1}};
  auto start = Clock::now();
  const Route route = find_route(*view, from, to, {}, work).or_throw();
  const double search_s = seconds_since(start);
  start = Clock::now();
  std::size_t steps = 0;
  for (RouteWalk walk(*view, route); walk.next();) ++steps;
  const double walk_s = seconds_since(start);

  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  report.add("frames", options.frames, "of the map, one behind the other");
  report.add("budget_mb", static_cast<double>(options.memory_budget_mb), "");
  report.add("steps", static_cast<double>(steps), "of the route from end to end");
  report.add("search_mb", static_cast<double>(most) / (1 << 20), "held by the search, at most");
  report.add("route_mb", static_cast<double>(route.path.memory_bytes()) / (1 << 20), "held while it is sent");
  report.add("search_s", search_s, "");
  report.add("walk_s", walk_s, "reading all its steps");
  report.add("rss_max_mb", static_cast<double>(usage.ru_maxrss) / 1024,
             "of the process; run again for that without making the map");
}

}  // namespace

Run declare_routes(CLI::App& app) {
  auto options = std::make_shared<Options>();
  app.add_option("--frames", options->frames, "Of the map, which is made if it is not there")->capture_default_str();
  app.add_option("--memory-budget-mb", options->memory_budget_mb, "Memory")->capture_default_str();
  app.add_option("--data", options->data, "Folder of the map")->capture_default_str();
  return [options](Report& report) { run(*options, report); };
}

}  // namespace relmap::bench
