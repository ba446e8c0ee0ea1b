// Routes through maps far larger than memory: what searches hold, how long they take, and whether they are right.
//
// `fleet`: robots drive about in a town of square blocks, each street is passed some ten times, and each crossing that
// any of them has passed is recognised. Cells (server/route/overlay) against Dijkstra on the same snapshot.
// `drive`: from end to end of one drive by Dijkstra.
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <queue>
#include <random>
#include <stdexcept>

#include "server/route/dijkstra.h"
#include "server/route/overlay/overlay.h"
#include "server/route/overlay/street_grid.h"
#include "storage/map.h"
#include "storage/rocksdb/rocksdb_engine.h"
#include "tools/bench/subcommand.h"

namespace relmap::bench {

namespace {

constexpr std::uint32_t kLandmarks = 12, kObservers = 4;

struct Options {
  std::string world = "fleet";
  std::uint32_t frames = 1'000'000;
  std::uint32_t queries = 1000;
  std::size_t memory_budget_mb = 256;
  std::string data;
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

struct StoredMap {
  explicit StoredMap(const Options& options) : budget(std::make_shared<Budget>(options.memory_budget_mb << 20)) {
    RocksDbOptions engine_options;
    engine_options.cache_bytes = budget->allowance(Share::kEngine);
    engine = open_rocksdb(options.data, engine_options).or_throw();
    map = Map::open(engine, engine->acquire().or_throw(), budget).or_throw();
  }
  void tell_budget() const { budget->set(Share::kEngine, engine->memory_bytes()); }

  std::shared_ptr<Budget> budget;
  std::shared_ptr<Engine> engine;
  std::unique_ptr<Map> map;
};

void run_drive(const Options& options, Report& report) {
  StoredMap stored(options);
  drive_on(*stored.map, options.frames);

  const auto view = stored.map->view();
  std::size_t most = 0;
  const WorkLimit work{.proceed = [&](std::size_t bytes) {
    most = std::max(most, bytes);
    stored.tell_budget();
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

StreetGridOptions town_of(std::uint32_t frames) {
  StreetGridOptions town;
  town.robots = std::max(1u, frames / 50'000);
  town.frames_a_robot = frames / town.robots;
  const double streets = static_cast<double>(frames) / town.frames_a_block / 10;  // each passed ten times
  town.crossings = std::max(4u, static_cast<std::uint32_t>(std::lround(std::sqrt(streets / 2))));
  return town;
}

void take_in(const StreetGrid& town, const StoredMap& stored) {
  Map& map = *stored.map;
  for (const Session& session : town.sessions()) {
    if (map.session(session.number)) {
      if (map.session(session.number)->frames != session.frames || !map.hot({session.number, session.last}))
        throw std::runtime_error("the map in the folder is another, or was broken off; remove it");
      continue;
    }
    map.add_session(session);
    for (std::uint32_t i = 0; i < session.frames; ++i) {
      map.add_frame({session.number, i}, *town.hot({session.number, i}), {}, {});
      if (i % 2000 != 1999 && i + 1 < session.frames) continue;
      if (Status status = map.commit(); !status.ok()) throw StatusError(status);
      stored.tell_budget();
    }
  }
}

// Costs from one frame to all, by the book, over arrays that hold the whole graph.
class OneToAll {
 public:
  OneToAll(const StreetGrid& town, const Graph& graph, const RouteWeights& weights)
      : a_robot_(town.frames() / static_cast<std::uint32_t>(town.sessions().size())) {
    begin_.push_back(0);
    for (std::uint32_t n = 0; n < town.frames(); ++n) {
      const auto hot = graph.hot(frame(n));
      for (const Neighbour& step : neighbours(graph, frame(n), *hot)) {
        const EdgeRef edge(graph, frame(n), hot, step);
        arcs_.push_back({number(step.frame), weights(costs(*edge))});
      }
      begin_.push_back(static_cast<std::uint32_t>(arcs_.size()));
    }
  }
  std::uint64_t edges() const { return arcs_.size() / 2; }
  FrameId frame(std::uint32_t number) const { return {1 + number / a_robot_, number % a_robot_}; }
  std::uint32_t number(FrameId frame) const { return (frame.session - 1) * a_robot_ + frame.index; }

  std::vector<double> from(FrameId start) const {
    std::vector<double> cost(begin_.size() - 1, std::numeric_limits<double>::infinity());
    using Offer = std::pair<double, std::uint32_t>;
    std::priority_queue<Offer, std::vector<Offer>, std::greater<>> queue;
    queue.push({cost[number(start)] = 0, number(start)});
    while (!queue.empty()) {
      const auto [best, n] = queue.top();
      queue.pop();
      if (best > cost[n]) continue;
      for (std::uint32_t i = begin_[n]; i < begin_[n + 1]; ++i)
        if (const double way = best + arcs_[i].cost; way < cost[arcs_[i].to])
          queue.push({cost[arcs_[i].to] = way, arcs_[i].to});
    }
    return cost;
  }

 private:
  struct Arc {
    std::uint32_t to;
    double cost;
  };
  const std::uint32_t a_robot_;
  std::vector<std::uint32_t> begin_;
  std::vector<Arc> arcs_;
};

void run_fleet(const Options& options, Report& report) {
  const StreetGrid town(town_of(options.frames));
  const std::vector<RouteWeights> metrics{kByDistance, kByTime, {1, 0.5, 0, 0}, {1, 0.2, 0.2, 20}, {0, 1, 1, 100}};
  const StoredMap stored(options);
  take_in(town, stored);
  auto view = stored.map->view();

  auto start = Clock::now();
  Overlay overlay(metrics);
  overlay.build(*view);
  const double build_s = seconds_since(start);

  std::mt19937_64 random(1);
  std::vector<double> query_ms, cold_ms;
  double chunks_opened = 0, settled = 0;
  const auto ask = [&](std::size_t metric, FrameId from, FrameId to) {
    const std::vector<FrameId> starts{from}, goals{to};
    start = Clock::now();
    OverlayRoute route = find_route(overlay, *view, metric, starts, goals).or_throw();
    if (Status status = unpack(overlay, *view, metric, route); !status.ok()) throw StatusError(status);
    (cold_ms.size() < 50 ? cold_ms : query_ms).push_back(1e3 * seconds_since(start));
    chunks_opened += route.chunks_opened;
    settled += static_cast<double>(route.nodes_settled);
    return route.cost;
  };
  for (int i = 0; i < 50; ++i) ask(random() % metrics.size(), town.random_frame(random), town.random_frame(random));

  double mismatches = 0;
  std::uint64_t edges = 0;
  for (std::size_t metric = 0; metric < metrics.size(); ++metric) {
    const OneToAll reference(town, *view, metrics[metric]);
    edges = reference.edges();
    const std::size_t sources = std::max<std::size_t>(1, options.queries / metrics.size() / 100);
    for (std::size_t s = 0; s < sources; ++s) {
      const FrameId from = town.random_frame(random);
      const std::vector<double> costs = reference.from(from);
      for (int t = 0; t < 100; ++t) {
        const FrameId to = town.random_frame(random);
        const double expected = costs[reference.number(to)];
        mismatches += std::abs(ask(metric, from, to) - expected) > 1e-9 * expected;
      }
    }
  }

  std::vector<double> dijkstra_ms;
  for (int i = 0; i < 9; ++i) {
    const std::vector<FrameId> from{town.random_frame(random)}, to{town.random_frame(random)};
    start = Clock::now();
    find_route(*view, from, to, {}).or_throw();
    dijkstra_ms.push_back(1e3 * seconds_since(start));
    stored.tell_budget();
  }

  std::vector<double> update_us, all_levels_us;
  for (int i = 0; i < 20; ++i) {
    const FrameId frame{1 + static_cast<SessionNumber>(random() % town.sessions().size()),
                        1 + static_cast<std::uint32_t>(random() % (town.sessions()[0].frames - 1))};
    stored.map->edit_hot(frame).edges[0].T_ab.t *= 1.01;
    view = stored.map->publish();
    start = Clock::now();
    make_cell(frames_of(*view, chunk_id(frame)), chunk_id(frame), metrics);
    update_us.push_back(1e6 * seconds_since(start));
    const std::vector<ChunkId> changed{chunk_id(frame), chunk_id({frame.session, frame.index - 1})};
    start = Clock::now();
    overlay.refresh(*view, changed);
    all_levels_us.push_back(1e6 * seconds_since(start));
  }

  for (int i = 0; i < 5; ++i) {
    const std::vector<FrameId> from{town.random_frame(random)}, to{town.random_frame(random)};
    const double expected = find_route(*view, from, to, {}).or_throw().cost;
    mismatches += std::abs(find_route(overlay, *view, 0, from, to).or_throw().cost - expected) > 1e-9 * expected;
    stored.tell_budget();
  }

  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  const double asked = static_cast<double>(query_ms.size() + cold_ms.size());
  report.add("frames", town.frames(), "of the map");
  report.add("edges", static_cast<double>(edges), "");
  report.add("queries", asked, "between any two frames, by distance, time and three mixes");
  report.add("query_p50_ms", quantile(query_ms, 0.5), "cost of the route and the chunks on the way");
  report.add("query_p99_ms", quantile(query_ms, 0.99), "");
  report.add("cold_p50_ms", quantile(cold_ms, 0.5), "of the first 50");
  report.add("dijkstra_p50_ms", quantile(dijkstra_ms, 0.5), "frame by frame");
  report.add("chunks_opened_mean", chunks_opened / asked, "read frame by frame, at the ends");
  report.add("nodes_settled_mean", settled / asked, "frames at which a cell was entered");
  report.add("overlay_bytes_per_frame", static_cast<double>(overlay.memory_bytes()) / town.frames(),
             "cells of all levels, five metrics");
  report.add("build_s", build_s, "all cells anew");
  report.add("update_us", quantile(update_us, 0.5), "the cell of a chunk that changed, anew");
  report.add("update_all_us", quantile(all_levels_us, 0.5), "and all cells around it");
  report.add("mismatches", mismatches, "more than 1e-9 from Dijkstra's costs, after the changes, too");
  report.add("budget_mb", static_cast<double>(options.memory_budget_mb), "of the map, without its cells");
  report.add("rss_max_mb", static_cast<double>(usage.ru_maxrss) / 1024, "of the process, the reference's arrays, too");
}

}  // namespace

Run declare_routes(CLI::App& app) {
  auto options = std::make_shared<Options>();
  app.add_option("--world", options->world, "fleet: many robots in a town; drive: one, straight on")
      ->check(CLI::IsMember({"fleet", "drive"}))
      ->capture_default_str();
  app.add_option("--frames", options->frames, "Of the map, which is made if it is not there")
      ->check(CLI::Range(1000u, 100'000'000u))
      ->capture_default_str();
  app.add_option("--queries", options->queries, "Of the fleet")->capture_default_str();
  app.add_option("--memory-budget-mb", options->memory_budget_mb, "Memory")->capture_default_str();
  app.add_option("--data", options->data, "Folder of the map (relmap-bench-routes-WORLD-FRAMES)");
  return [options](Report& report) {
    if (options->data.empty())
      options->data = "relmap-bench-routes-" + options->world + "-" + std::to_string(options->frames);
    options->world == "drive" ? run_drive(*options, report) : run_fleet(*options, report);
  };
}

}  // namespace relmap::bench
