// Routes through maps far larger than memory: the memory and time of searches, and whether they are right.
//
// `fleet`: robots drive about in a town of square blocks, each street is passed some ten times, and each crossing that
// any of them has passed is recognised. Cells (server/route/overlay) against Dijkstra on the same snapshot.
// `drive`: from end to end of one drive by Dijkstra.
#include <sys/resource.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <memory>
#include <queue>
#include <random>
#include <stdexcept>
#include <thread>

#include "server/map/closure_list.h"
#include "server/route/dijkstra.h"
#include "server/route/overlay/overlay_search.h"
#include "server/route/overlay/overlay_table.h"
#include "server/route/overlay/route_index.h"
#include "server/route/overlay/route_search.h"
#include "server/route/testing/street_grid.h"
#include "server/rpc/limits.h"
#include "storage/map/map.h"
#include "storage/rocksdb/rocksdb_engine.h"
#include "tools/bench/stopwatch.h"
#include "tools/bench/subcommand.h"

namespace relmap::bench {

namespace {

constexpr std::uint32_t kLandmarks = 12, kObservers = 4;

struct RoutesOptions {
  std::string world = "fleet";
  std::uint32_t frames = 1'000'000;
  std::uint32_t queries = 1000;
  std::uint32_t metrics = 5;
  int live_seconds = 20;
  std::size_t memory_budget_mb = 512;
  std::string data;
};

storage::FrameHot frame_of_drive(std::uint32_t index) {
  storage::FrameHot hot;
  hot.present = true;
  hot.time_us = 1'600'000'000'000'000 + std::int64_t{index} * 500'000;
  if (index > 0) {
    storage::Edge edge;
    edge.id = {{1, index}, 0};
    edge.a = {1, index - 1};
    edge.b = {1, index};
    edge.T_ab.t = {0.01, 0, 0.8 + 0.001 * (index % 100)};
    edge.covariance = 1e-4 * Matrix6::Identity();
    edge.driven_s = 0.5f;
    hot.edges.push_back(edge);
  }
  for (std::uint32_t slot = 0; slot < kLandmarks; ++slot) {
    storage::Landmark landmark;
    landmark.track = {index, slot};
    for (std::uint32_t i = 0; i < kObservers; ++i) landmark.observers.push_back({1, index + i});
    hot.landmarks.push_back(landmark);
  }
  return hot;
}

void drive_on(storage::Map& map, std::uint32_t frames) {
  if (!map.session(1)) {
    storage::Session session;
    session.number = 1;
    session.header.name = "light";
    map.add_session(session);
  }
  for (std::uint32_t i = map.session(1)->next_sequence; i < frames; ++i) {
    map.add_frame({1, i}, frame_of_drive(i), {}, {});
    if (i > 0) map.edit_hot({1, i - 1}).incoming = {{{1, i}, 0}};
    storage::Session& session = map.edit_session(1);
    session.last = i;
    session.next_sequence = i + 1;
    ++session.frames;
    ++map.state().keyframes;
    if (i % 2000 == 1999 || i + 1 == frames)
      if (Status status = map.commit(); !status.ok()) throw StatusError(status);
  }
}

struct StoredMap {
  explicit StoredMap(const RoutesOptions& options)
      : budget(std::make_shared<storage::Budget>(options.memory_budget_mb << 20)) {
    storage::RocksDbOptions engine_options;
    engine_options.cache_bytes = budget->allowance(storage::Share::kEngine);
    engine = storage::open_rocksdb(options.data, engine_options).or_throw();
    map = storage::Map::open(engine, engine->acquire().or_throw(), budget).or_throw();
  }
  void tell_budget() const { budget->set(storage::Share::kEngine, engine->memory_bytes()); }

  std::shared_ptr<storage::Budget> budget;
  std::shared_ptr<storage::Engine> engine;
  std::unique_ptr<storage::Map> map;
};

void run_drive(const RoutesOptions& options, Report& report) {
  StoredMap stored(options);
  drive_on(*stored.map, options.frames);

  const auto view = stored.map->view();
  std::size_t max_bytes = 0;
  const route::WorkLimit work{.proceed = [&](std::size_t bytes) {
    max_bytes = std::max(max_bytes, bytes);
    stored.tell_budget();
    return Status();
  }};
  const std::vector<FrameId> from{{1, 0}}, to{{1, options.frames - 1}};
  auto start = Clock::now();
  const route::Route route = route::find_route(*view, from, to, {}, work).or_throw();
  const double search_s = seconds_since(start);
  start = Clock::now();
  std::size_t steps = 0;
  for (route::RouteWalk walk(*view, route); walk.next();) ++steps;
  const double walk_s = seconds_since(start);

  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  report.add("frames", options.frames, "of the map, one behind the other");
  report.add("budget_mb", static_cast<double>(options.memory_budget_mb), "");
  report.add("steps", static_cast<double>(steps), "of the route from end to end");
  report.add("search_mb", static_cast<double>(max_bytes) / (1 << 20), "held by the search, at most");
  report.add("route_mb", static_cast<double>(route.path.memory_bytes()) / (1 << 20), "held while it is sent");
  report.add("search_s", search_s, "");
  report.add("walk_s", walk_s, "reading all its steps");
  report.add("rss_max_mb", static_cast<double>(usage.ru_maxrss) / 1024,
             "of the process; run again for that without making the map");
}

route::StreetGridOptions town_of(std::uint32_t frames) {
  route::StreetGridOptions town;
  town.robots = std::max(1u, frames / 50'000);
  town.frames_a_robot = frames / town.robots;
  const double streets = static_cast<double>(frames) / town.frames_a_block / 10;  // each passed ten times
  town.crossings = std::max(4u, static_cast<std::uint32_t>(std::lround(std::sqrt(streets / 2))));
  return town;
}

void take_in(const route::StreetGrid& town, const StoredMap& stored) {
  storage::Map& map = *stored.map;
  for (const storage::Session& session : town.sessions()) {
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

// Costs from one frame to all by textbook Dijkstra, on arrays that hold the whole graph.
class OneToAll {
 public:
  OneToAll(const route::StreetGrid& town, const storage::Graph& graph, const route::RouteWeights& weights)
      : a_robot_(town.frames() / static_cast<std::uint32_t>(town.sessions().size())) {
    begin_.push_back(0);
    for (std::uint32_t n = 0; n < town.frames(); ++n) {
      const auto hot = graph.hot(frame(n));
      for (const storage::Neighbour& step : storage::neighbours(graph, frame(n), *hot)) {
        const route::EdgeRef edge(graph, frame(n), hot, step);
        arcs_.push_back({number(step.frame), weights(route::costs(*edge))});
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

const std::vector<route::RouteWeights> kMetrics{
    route::kByDistance, route::kByTime, {1, 0.5, 0, 0}, {1, 0.2, 0.2, 20}, {0, 1, 1, 100}};

// Searches by cells, timed.
struct Asked {
  route::RouteFilter filter = {};
  std::vector<double> ms, unpack_ms;
  double chunks_opened = 0, settled = 0;

  double cost(const route::RouteIndex::Snapshot& map, std::size_t metric, FrameId from, FrameId to) {
    const std::vector<FrameId> starts{from}, goals{to};
    route::OverlayQuery query;
    query.metric = metric;
    query.stale = map.stale;
    query.filter = filter;
    if (!filter.refuses_nothing()) query.opened = route::cells_to_open(*map.overlay, filter).value();
    const auto start = Clock::now();
    route::OverlayRoute route = route::find_route(*map.overlay, *map.view, query, starts, goals).or_throw();
    const double found = seconds_since(start);
    if (Status status = route::unpack(*map.overlay, *map.view, metric, route); !status.ok()) throw StatusError(status);
    ms.push_back(1e3 * seconds_since(start));
    unpack_ms.push_back(ms.back() - 1e3 * found);
    chunks_opened += route.chunks_opened;
    settled += static_cast<double>(route.nodes_settled);
    return route.cost;
  }
  double mean(double sum) const { return sum / static_cast<double>(ms.size()); }
};

// Robots that drive about in the town while it is asked for routes: each follows the way that another took, closes a
// loop wherever that is a crossing, and has its last edges and those around it there estimated anew; loops anywhere are
// removed and restored on request.
class Traffic {
 public:
  Traffic(const route::StreetGrid& town, storage::Map& map) : town_(town), map_(map), random_(7) {
    for (SessionNumber number = 1; number <= kRobots; ++number) {
      storage::Session session;
      session.number = static_cast<SessionNumber>(town.sessions().size()) + number;
      map.add_session(session);
      robots_.push_back({session.number, 0, town.random_frame(random_)});
    }
  }
  void keyframe() {
    Robot& robot = robots_[next_++ % kRobots];
    const FrameId id{robot.number, robot.frames};
    FrameId guide = robot.guide;
    guide.index = (guide.index + robot.frames) % town_.sessions()[0].frames;
    storage::FrameHot hot;
    hot.present = true;
    std::vector<storage::Edge> edges;
    if (robot.frames > 0)
      edges.push_back(edge(id, 0, {robot.number, robot.frames - 1}, storage::EdgeKind::kOdometry, 2));
    if (guide.index % 50 == 0 || robot.frames == 0) edges.push_back(edge(id, 1, guide, storage::EdgeKind::kLoop, 0.5));
    hot.edges = edges;
    map_.add_frame(id, std::move(hot), {}, {});
    for (const storage::Edge& added : edges) {
      auto& incoming = map_.edit_hot(added.a).incoming;
      incoming.insert(std::lower_bound(incoming.begin(), incoming.end(), added.id), added.id);
    }
    for (std::uint32_t back = 0; back < 6; ++back) {
      if (robot.frames >= back) anew({robot.number, robot.frames - back});
      if (guide.index >= back) anew({guide.session, guide.index - back});
    }
    ++robot.frames;
    storage::Session& session = map_.edit_session(robot.number);
    session.last = id.index;
    session.frames = robot.frames;
    map_.publish();
  }

  // Loop closures anywhere are removed, or restored.
  void toggle_loops() {
    for (int i = 0; i < 50; ++i) {
      FrameId crossing = town_.random_frame(random_);
      crossing.index -= crossing.index % 50;
      for (storage::Edge& edge : map_.edit_hot(crossing).edges)
        if (edge.kind == storage::EdgeKind::kLoop)
          edge.state =
              edge.state == storage::EdgeState::kRemoved ? storage::EdgeState::kAccepted : storage::EdgeState::kRemoved;
    }
    map_.publish();
  }

 private:
  static constexpr std::uint32_t kRobots = 10;
  struct Robot {
    SessionNumber number;
    std::uint32_t frames;
    FrameId guide;
  };
  static storage::Edge edge(FrameId id, std::uint32_t ordinal, FrameId to, storage::EdgeKind kind, double metres) {
    storage::Edge edge;
    edge.id = {id, ordinal};
    edge.a = to;
    edge.b = id;
    edge.kind = kind;
    edge.reason = Reason::CONSISTENT;
    edge.T_ab.t = {0, 0, metres};
    edge.covariance = 1e-3 * Matrix6::Identity();
    edge.driven_s = 0.2f;
    edge.support = 50;
    return edge;
  }
  void anew(FrameId frame) {
    for (storage::Edge& edge : map_.edit_hot(frame).edges)
      edge.T_ab.t *= 1 + 1e-4 * (static_cast<double>(random_() % 21) - 10);
  }

  const route::StreetGrid& town_;
  storage::Map& map_;
  std::mt19937_64 random_;
  std::vector<Robot> robots_;
  std::uint32_t next_ = 0;
};

void run_fleet(const RoutesOptions& options, Report& report) {
  const route::StreetGrid town(town_of(options.frames));
  const std::vector<route::RouteWeights> metrics(kMetrics.begin(), kMetrics.begin() + options.metrics);
  const StoredMap stored(options);
  take_in(town, stored);

  auto start = Clock::now();
  route::Overlay overlay(metrics, route::CellStore::open(options.data, stored.budget, 0).or_throw());
  overlay.build(*stored.map->view());
  stored.budget->charge(storage::Share::kRoutes, overlay.memory_bytes());
  // As the daemon's RouteIndex does.
  stored.budget->add_evictor(&overlay, [&] {
    const std::size_t used = stored.budget->used(storage::Share::kRoutes),
                      max_bytes = stored.budget->allowance(storage::Share::kRoutes);
    if (used > max_bytes) overlay.store()->evict(used - max_bytes);
  });
  const double build_s = seconds_since(start);
  const auto bytes = static_cast<double>(overlay.store()->bytes_in_use() + overlay.memory_bytes());
  std::size_t max_bytes = 0;
  route::RouteIndex::Snapshot map{stored.map->view(), std::make_shared<const route::Overlay>(overlay), {}, {}, {}};

  std::mt19937_64 random(1);
  const auto ask = [&](Asked& asked, std::size_t metric) {
    asked.cost(map, metric, town.random_frame(random), town.random_frame(random));
    max_bytes = std::max(max_bytes, stored.budget->used(storage::Share::kRoutes));
  };
  Asked cold, warming, warm;
  for (int i = 0; i < 50; ++i) ask(cold, random() % metrics.size());

  double mismatches = 0;
  std::uint64_t edges = 0;
  for (std::size_t metric = 0; metric < metrics.size(); ++metric) {
    const OneToAll reference(town, *map.view, metrics[metric]);
    edges = reference.edges();
    const std::size_t sources = std::max<std::size_t>(1, options.queries / metrics.size() / 100);
    for (std::size_t s = 0; s < sources; ++s) {
      const FrameId from = town.random_frame(random);
      const std::vector<double> costs = reference.from(from);
      if (s == 0)
        for (int i = 0; i < 50; ++i) ask(warming, metric);
      for (int t = 0; t < 100; ++t) {
        const FrameId to = town.random_frame(random);
        const double expected = costs[reference.number(to)];
        mismatches += std::abs(warm.cost(map, metric, from, to) - expected) > 1e-9 * expected;
      }
    }
  }

  // Short routes are searched again, frame by frame with closures that only bind.
  std::vector<double> near_ms;
  double near_missed = 0;
  Asked near_by_cells;
  route::RouteOptions with_bound;
  with_bound.filter.supposed.bound = true;
  const std::uint64_t near_steps = rpc::RpcLimits().near_route_steps;
  const route::WorkLimit near{.max_frames = route::kNearFramesAStep * near_steps, .proceed = {}};
  for (std::uint32_t i = 0; i < options.queries; ++i) {
    const FrameId from = town.random_frame(random);
    const std::vector<FrameId> starts{from},
        goals{{from.session, from.index - std::min(from.index, static_cast<std::uint32_t>(random() % near_steps))}};
    near_by_cells.cost(map, 0, starts[0], goals[0]);
    start = Clock::now();
    near_missed += !route::find_route(*map.view, starts, goals, with_bound, near).ok();
    near_ms.push_back(1e3 * seconds_since(start));
  }

  // Frames all over the town are to be avoided: a tenth of the cells of the highest level, at most, are opened.
  Asked filtered;
  const route::CellTree& tree = map.overlay->tree();
  const std::size_t highest = tree.chunks() > 0 ? tree.node(tree.root()).children.size() : 0;
  for (std::size_t i = 0; i < std::max<std::size_t>(1, highest / 10); ++i)
    filtered.filter.avoided.insert(town.random_frame(random));
  for (std::uint32_t i = 0; i < options.queries; ++i) {
    FrameId from = town.random_frame(random), to = town.random_frame(random);
    if (!filtered.filter.avoided.contains(from) && !filtered.filter.avoided.contains(to))
      filtered.cost(map, random() % metrics.size(), from, to);
  }

  // The same routes without and with alternatives, as they are answered.
  std::vector<double> alone_ms, alternatives_ratio;
  double alternatives = 0;
  for (std::uint32_t i = 0; i < std::max(1u, options.queries / 20); ++i) {
    const std::vector<FrameId> from{town.random_frame(random)}, to{town.random_frame(random)};
    start = Clock::now();
    const auto answer = route::search_route(map, from, to, {}, 0, {}).or_throw();
    const double alone = seconds_since(start);
    alternatives += static_cast<double>(route::search_alternatives(map, from, to, {}, 0, answer, 3, {}).size());
    alone_ms.push_back(1e3 * alone);
    alternatives_ratio.push_back(seconds_since(start) / alone);
  }

  // The closures of the whole map that are most suspicious, and how many there are between each two sessions.
  std::vector<double> list_ms, matrix_ms;
  const auto go_on = [] { return Status(); };
  for (int i = 0; i < 5; ++i) {
    start = Clock::now();
    map::first_closures(*map.view, {}, map::ClosureOrder::kSuspicion, {}, 1000, go_on).or_throw();
    list_ms.push_back(1e3 * seconds_since(start));
    start = Clock::now();
    map::closure_cells(*map.view, {}, {0, 0}, 1000, go_on).or_throw();
    matrix_ms.push_back(1e3 * seconds_since(start));
  }

  std::vector<double> follow_us, follow_cold_us;  // per 100 frames
  for (int i = 0; i < 200; ++i) {
    const std::vector<FrameId> from{town.random_frame(random)}, to{town.random_frame(random)};
    route::OverlayRoute route = route::find_route(*map.overlay, *map.view, route::OverlayQuery(), from, to).or_throw();
    if (Status status = route::unpack(*map.overlay, *map.view, 0, route); !status.ok()) throw StatusError(status);
    for (std::vector<double>* us : {&follow_cold_us, &follow_us}) {
      start = Clock::now();
      const route::Route frames = route::follow(*map.overlay, *map.view, 0, route, false).or_throw();
      if (frames.steps() > 500) us->push_back(1e8 * seconds_since(start) / static_cast<double>(frames.steps()));
    }
  }

  std::vector<double> dijkstra_ms;
  for (int i = 0; i < 9; ++i) {
    const std::vector<FrameId> from{town.random_frame(random)}, to{town.random_frame(random)};
    start = Clock::now();
    route::find_route(*map.view, from, to, {}).or_throw();
    dijkstra_ms.push_back(1e3 * seconds_since(start));
    stored.tell_budget();
  }

  std::vector<double> update_us, all_levels_us;
  for (int i = 0; i < 20; ++i) {
    const FrameId frame{1 + static_cast<SessionNumber>(random() % town.sessions().size()),
                        1 + static_cast<std::uint32_t>(random() % (town.sessions()[0].frames - 1))};
    stored.map->edit_hot(frame).edges[0].T_ab.t *= 1.01;
    map.view = stored.map->publish();
    const std::vector<storage::ChunkId> changed{storage::chunk_id(frame)};
    start = Clock::now();
    overlay.refresh(*map.view, changed);
    update_us.push_back(1e6 * seconds_since(start));
    while (overlay.make_next()) {
    }
    all_levels_us.push_back(1e6 * seconds_since(start));
  }
  const auto mismatches_now = [&] {
    const std::vector<FrameId> from{town.random_frame(random)}, to{town.random_frame(random)};
    const std::size_t metric = random() % metrics.size();
    route::RouteOptions how;
    how.weights = metrics[metric];
    const double expected = route::find_route(*map.view, from, to, how).or_throw().cost;
    Asked asked;
    mismatches += std::abs(asked.cost(map, metric, from[0], to[0]) - expected) > 1e-9 * expected;
    stored.tell_budget();
  };
  map.overlay = std::make_shared<const route::Overlay>(overlay);
  for (int i = 0; i < 5; ++i) mismatches_now();

  // Written when a run ends, and read when the next begins.
  stored.budget->remove_evictor(&overlay);
  stored.budget->release(storage::Share::kRoutes, overlay.memory_bytes());
  map.overlay.reset();
  start = Clock::now();
  if (Status status = route::write_table(options.data, 1, overlay, {}); !status.ok()) throw StatusError(status);
  overlay = route::Overlay(metrics, nullptr);
  if (!route::take_table(options.data, 1, metrics, stored.budget, 0))
    throw std::runtime_error("the cells were not kept");
  const double reopen_s = seconds_since(start);

  Traffic traffic(town, *stored.map);
  const auto burst_s = [&] {
    const auto begin = Clock::now();
    for (int i = 0; i < 1000; ++i) traffic.keyframe();
    return seconds_since(begin);
  };
  std::vector<double> alone_s, beside_s;
  for (int i = 0; i < 5; ++i) burst_s();  // what is read from disk
  for (int i = 0; i < 5; ++i) alone_s.push_back(burst_s());
  route::RouteIndex index(
      {options.data, 0, metrics}, [&] { return stored.map->view(); }, stored.budget);
  stored.map->watch_edits(
      [&](std::uint64_t version, std::span<const storage::ChunkId> chunks) { index.changed(version, chunks); });
  index.start();
  const auto wait_for_cells = [&] {
    if (!index.wait_current(Clock::now() + std::chrono::hours(1)) || !index.snapshot().overlay)
      throw std::runtime_error("no cells: " + index.snapshot().missing_because);
  };
  wait_for_cells();
  for (int i = 0; i < 5; ++i) beside_s.push_back(burst_s());
  wait_for_cells();

  // Routes are asked for at intervals, first while nothing arrives, then with twenty keyframes a second and new cells.
  const auto ask_now_and_then = [&](Asked& asked, const auto& look_at) {
    for (const auto until = Clock::now() + std::chrono::seconds(options.live_seconds); Clock::now() < until;) {
      map = index.snapshot();
      look_at();
      ask(asked, random() % metrics.size());
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  };
  Asked warming_again, idle, live;
  ask_now_and_then(warming_again, [] {});
  ask_now_and_then(idle, [] {});
  double stale = 0, outdated = 0;
  std::atomic<bool> driving = true;
  std::thread robots([&] {
    for (auto next = Clock::now(); driving; std::this_thread::sleep_until(next)) {
      traffic.keyframe();
      next += std::chrono::milliseconds(50);
    }
  });
  ask_now_and_then(live, [&] {
    stale += static_cast<double>(map.stale.size());
    outdated += static_cast<double>(map.overlay->outdated());
  });
  for (int i = 0; i < 3; ++i) {
    map = index.snapshot();
    mismatches_now();
  }
  driving = false;
  robots.join();
  for (int i = 0; i < 5; ++i) {
    traffic.toggle_loops();
    map = index.snapshot();
    mismatches_now();
  }
  stored.map->watch_edits({});

  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  report.add("frames", town.frames(), "of the map");
  report.add("edges", static_cast<double>(edges), "");
  report.add("metrics", static_cast<double>(metrics.size()), "distance, time and mixes");
  report.add("queries", static_cast<double>(warm.ms.size()), "between any two frames");
  report.add("query_p50_ms", quantile(warm.ms, 0.5),
             "cost of the route and the chunks on the way; after 50 more of each kind");
  report.add("query_p99_ms", quantile(warm.ms, 0.99), "");
  report.add("near_cells_p50_ms", quantile(near_by_cells.ms, 0.5), "of routes of 50 steps at most");
  report.add("near_p50_ms", quantile(near_ms, 0.5), "these once more, frame by frame with closures that only bind");
  report.add("near_p99_ms", quantile(near_ms, 0.99), "");
  report.add("near_missed_share", near_missed / options.queries, "not found among so many frames");
  report.add("filtered_p50_ms", quantile(filtered.ms, 0.5), "around a frame that is to be avoided");
  report.add("filtered_p99_ms", quantile(filtered.ms, 0.99), "");
  report.add("route_p50_ms", quantile(alone_ms, 0.5), "of a route with all its frames");
  report.add("alternatives_ratio_p50", quantile(alternatives_ratio, 0.5), "with three alternatives, times as long");
  report.add("alternatives_ratio_p90", quantile(alternatives_ratio, 0.9), "");
  report.add("alternatives_mean", alternatives / static_cast<double>(alone_ms.size()), "found, of three");
  report.add("list_ms", quantile(list_ms, 0.5), "the 1,000 most suspicious closures of the map");
  report.add("matrix_ms", quantile(matrix_ms, 0.5), "the number of closures between each two sessions");
  report.add("unpack_p50_ms", quantile(warm.unpack_ms, 0.5), "of that, the chunks on the way");
  report.add("cold_p50_ms", quantile(cold.ms, 0.5), "of the first 50");
  report.add("follow_us", quantile(follow_us, 0.5), "frame by frame, each 100 frames of the route, in memory");
  report.add("follow_cold_us", quantile(follow_cold_us, 0.5), "from disk");
  report.add("dijkstra_p50_ms", quantile(dijkstra_ms, 0.5), "frame by frame");
  report.add("chunks_opened_mean", warm.mean(warm.chunks_opened), "read frame by frame, at the ends");
  report.add("nodes_settled_mean", warm.mean(warm.settled), "frames at which a cell was entered");
  report.add("overlay_bytes_per_frame", bytes / town.frames(), "cells of all levels and metrics");
  report.add("build_s", build_s, "all cells anew");
  report.add("update_us", quantile(update_us, 0.5), "the cell of a chunk that changed, anew");
  report.add("update_all_us", quantile(all_levels_us, 0.5), "and all cells around it");
  report.add("idle_p50_ms", quantile(idle.ms, 0.5), "asked each 5 ms, while nothing arrives");
  report.add("idle_p99_ms", quantile(idle.ms, 0.99), "");
  report.add("live_p50_ms", quantile(live.ms, 0.5), "so asked while ten robots send twenty keyframes a second");
  report.add("live_p99_ms", quantile(live.ms, 0.99), "");
  report.add("live_stale_mean", live.mean(stale), "chunks that cells do not know yet");
  report.add("live_outdated_mean", live.mean(outdated), "cells that are passed part by part");
  report.add("ingest_slowdown", quantile(beside_s, 0.5) / quantile(alone_s, 0.5) - 1,
             "share by which the same keyframes take longer with the cells' thread beside, as fast as they are taken");
  report.add("reopen_s", reopen_s, "what is known of the cells, written and read again");
  report.add("overlay_memory_mb", static_cast<double>(max_bytes) / (1 << 20), "of the budget, at most");
  report.add("mismatches", mismatches, "more than 1e-9 from Dijkstra's costs, after the changes, too");
  report.add("budget_mb", static_cast<double>(options.memory_budget_mb), "of the map with its cells");
  report.add("rss_max_mb", static_cast<double>(usage.ru_maxrss) / 1024, "of the process, the reference's arrays, too");
}

}  // namespace

Run declare_routes(CLI::App& app) {
  auto options = std::make_shared<RoutesOptions>();
  app.add_option("--world", options->world, "fleet: many robots in a town; drive: one robot, straight on")
      ->check(CLI::IsMember({"fleet", "drive"}))
      ->capture_default_str();
  app.add_option("--frames", options->frames, "Frames of the map, which is made if it does not exist")
      ->check(CLI::Range(1000u, 100'000'000u))
      ->capture_default_str();
  app.add_option("--queries", options->queries, "Number of routes (fleet)")->capture_default_str();
  app.add_option("--metrics", options->metrics, "Number of kinds of cost (fleet)")
      ->check(CLI::Range(1u, static_cast<unsigned>(kMetrics.size())))
      ->capture_default_str();
  app.add_option("--live-seconds", options->live_seconds, "Seconds in which keyframes arrive (fleet)")
      ->check(CLI::Range(1, 3600))
      ->capture_default_str();
  app.add_option("--memory-budget-mb", options->memory_budget_mb, "Memory budget")->capture_default_str();
  app.add_option("--data", options->data, "Folder of the map (relmap-bench-routes-WORLD-FRAMES)");
  return [options](Report& report) {
    if (options->data.empty())
      options->data = "relmap-bench-routes-" + options->world + "-" + std::to_string(options->frames);
    options->world == "drive" ? run_drive(*options, report) : run_fleet(*options, report);
  };
}

}  // namespace relmap::bench
