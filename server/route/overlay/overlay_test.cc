#include "server/route/overlay/overlay.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <random>
#include <set>

#include "server/route/dijkstra.h"
#include "server/route/overlay/labels.h"
#include "server/route/overlay/overlay_search.h"
#include "server/route/overlay/reachability.h"
#include "server/route/testing/drawn_map.h"
#include "server/route/testing/street_grid.h"
#include "storage/testing/partial_graph.h"

namespace relmap::route {
namespace {

const std::vector<RouteWeights> kMetrics{kByDistance, kByTime, kByTimeStandingToo, {1, 0.5, 0.2, 30}};

// The cost of the cheapest path within a chunk, frame by frame.
double cost_within(const storage::Graph& graph, const RouteWeights& weights, FrameId from, FrameId to) {
  const CellFrames frames = frames_of(graph, storage::chunk_id(from));
  std::vector<double> cost(frames.nodes.size(), kUnreachable);
  cost[frames.find(from)] = 0;
  for (bool cheaper = true; cheaper;) {
    cheaper = false;
    for (std::uint32_t n = 0; n < frames.nodes.size(); ++n)
      for (const Link& link : frames.links_of(n))
        if (const std::uint32_t end = frames.find(link.to); link.out && end != CellFrames::kNone)
          if (const double way = cost[n] + weights(link.costs()); way < cost[end]) {
            cost[end] = way;
            cheaper = true;
          }
  }
  return cost[frames.find(to)];
}

// Expects that the overlay finds Dijkstra's cost and that its hops are a path of that cost through the graph.
void expect_as_dijkstra(const Overlay& overlay, const storage::Graph& graph, const OverlayQuery& query, FrameId from,
                        FrameId to) {
  const std::vector<FrameId> starts{from}, goals{to};
  const RouteWeights& weights = overlay.metrics()[query.metric];
  RouteOptions options;
  options.weights = weights;
  options.filter = query.filter;
  options.max_cost = query.max_cost;
  const auto expected = find_route(graph, starts, goals, options);
  auto found = find_route(overlay, graph, query, starts, goals);
  ASSERT_EQ(found.ok(), expected.ok()) << from.to_string() << " to " << to.to_string();
  if (!expected.ok()) {
    EXPECT_EQ(found.reason(), expected.reason());
    return;
  }
  EXPECT_NEAR(found->cost, expected->cost, 1e-9 * expected->cost);
  ASSERT_TRUE(unpack(overlay, graph, query.metric, *found).ok());
  Passage passage(graph, query.filter);
  FrameId at = from;
  double cost = 0;
  for (const Hop& hop : found->hops) {
    ASSERT_EQ(hop.from, at);
    at = hop.to;
    if (hop.cell != CellTree::kNone) {
      ASSERT_EQ(storage::chunk_id(hop.from), storage::chunk_id(hop.to));
      cost += cost_within(graph, weights, hop.from, hop.to);
      continue;
    }
    const auto edge = storage::find_edge(graph, hop.edge);
    ASSERT_TRUE(edge.has_value() && edge->in_graph());
    EXPECT_EQ(hop.forward ? edge->a : edge->b, hop.from);
    EXPECT_EQ(hop.forward ? edge->b : edge->a, hop.to);
    EXPECT_TRUE(passage.open(*edge, hop.forward));
    cost += weights(costs(*edge));
  }
  EXPECT_EQ(at, to);
  EXPECT_NEAR(cost, expected->cost, 1e-9 * expected->cost);

  const Route route = follow(overlay, graph, query.metric, *found, false).or_throw();
  EXPECT_NEAR(route.cost, expected->cost, 1e-9 * expected->cost);
  RouteWalk walk(graph, route);
  std::optional<RouteStep> last;
  double walked = 0;
  for (auto step = walk.next(); step; step = walk.next()) {
    EXPECT_TRUE(passage.open(step->frame));
    if (last) {
      const auto edge = storage::find_edge(graph, last->edge);
      ASSERT_TRUE(edge.has_value());
      EXPECT_TRUE(passage.open(*edge, edge->a == last->frame && edge->b == step->frame));
      walked += weights(costs(*edge));
    } else {
      EXPECT_EQ(step->frame, from);
    }
    last = step;
  }
  ASSERT_TRUE(last.has_value());
  EXPECT_EQ(last->frame, to);
  EXPECT_NEAR(walked, expected->cost, 1e-9 * expected->cost);
  EXPECT_NEAR(last->distance_m, route.distance_m, 1e-9 * route.distance_m);
}
void expect_as_dijkstra(const Overlay& overlay, const storage::Graph& graph, std::size_t metric, FrameId from,
                        FrameId to) {
  OverlayQuery query;
  query.metric = metric;
  expect_as_dijkstra(overlay, graph, query, from, to);
}

std::size_t make_all(Overlay& overlay) {
  std::size_t looked_at = 0;
  while (overlay.make_next()) ++looked_at;
  return looked_at;
}

StreetGridOptions small_town(std::uint64_t seed) {
  StreetGridOptions options;
  options.seed = seed;
  options.robots = 6;
  options.frames_a_robot = 3000;
  options.crossings = 8;
  return options;
}

TEST(Overlay, FindsWhatDijkstraFinds) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    StreetGridOptions options = small_town(seed);
    options.oneway_share = 0.2 * static_cast<double>(seed - 1);
    const StreetGrid town(options);
    Overlay overlay(kMetrics, CellStore::open_temporary().or_throw());
    overlay.build(town);
    std::mt19937_64 random(seed);
    for (int query = 0; query < 60; ++query)
      expect_as_dijkstra(overlay, town, random() % kMetrics.size(), town.random_frame(random),
                         town.random_frame(random));
  }
}

// Edges are estimated anew, and closures are removed and come back. Routes must be right while the cells are stale,
// while some are outdated, and when all are current.
TEST(Overlay, FollowsTheMap) {
  StreetGridOptions options = small_town(4);
  options.oneway_share = 0.3;
  StreetGrid town(options);
  Overlay overlay(kMetrics, CellStore::open_temporary().or_throw());
  overlay.build(town);
  std::mt19937_64 random(4);
  for (int round = 0; round < 12; ++round) {
    std::set<storage::ChunkId> edited;  // the chunks that store the edges
    for (int change = 0; change < 5; ++change) {
      FrameId frame = town.random_frame(random);
      if (change == 2) frame.index = std::max(1u, frame.index / storage::kFramesPerChunk) * storage::kFramesPerChunk;
      const FrameId crossing{frame.session, frame.index / 50 * 50};
      const auto recognised = town.recognised_at(crossing);
      if (change % 2 == 0 && frame.index > 0) {
        town.set_length(frame, false, 0.2 + 0.02 * static_cast<double>(random() % 100));
        edited.insert(storage::chunk_id(frame));
      } else if (recognised) {
        const storage::EdgeState states[] = {storage::EdgeState::kAccepted, storage::EdgeState::kRemoved,
                                             storage::EdgeState::kQuarantined, storage::EdgeState::kCandidate};
        town.set_state(crossing, states[random() % 4]);
        edited.insert(storage::chunk_id(crossing));
      }
    }
    const std::vector<storage::ChunkId> changed(edited.begin(), edited.end());
    const auto ask = [&](std::span<const storage::ChunkId> stale) {
      for (int i = 0; i < 6; ++i) {
        OverlayQuery query;
        query.metric = random() % kMetrics.size();
        query.stale = stale;
        const bool near = i == 0 && !changed.empty();
        expect_as_dijkstra(overlay, town, query, near ? storage::frame_in(changed[0], 5) : town.random_frame(random),
                           town.random_frame(random));
      }
    };
    ask(changed);
    overlay.refresh(town, changed);
    ask({});
    for (std::size_t step = random() % 8; step > 0; --step) overlay.make_next();
    ask({});
    make_all(overlay);
    EXPECT_EQ(overlay.outdated(), 0u);
    ask({});
  }
}

// The first frames of each robot of a town.
class SoFar final : public storage::PartialGraph {
 public:
  explicit SoFar(const StreetGrid& town) : town_(town) {}
  std::uint32_t frames_a_robot = 0;

  bool has(FrameId id) const { return id.index < frames_a_robot; }
  std::shared_ptr<const storage::FrameHot> hot(FrameId id) const override {
    const auto hot = has(id) ? town_.hot(id) : nullptr;
    if (!hot) return nullptr;
    auto known = std::make_shared<storage::FrameHot>(*hot);
    std::erase_if(known->incoming, [&](EdgeId edge) { return !has(edge.frame); });
    std::erase_if(known->edges, [&](const storage::Edge& edge) { return !has(edge.a); });
    return known;
  }
  std::vector<storage::Session> all_sessions() const override {
    std::vector<storage::Session> all = frames_a_robot == 0 ? std::vector<storage::Session>() : town_.sessions();
    for (storage::Session& session : all) limit(session);
    return all;
  }
  std::optional<storage::Session> session(SessionNumber number) const override {
    auto session = town_.session(number);
    if (session) limit(*session);
    return session;
  }

 private:
  void limit(storage::Session& session) const {
    session.frames = frames_a_robot;
    session.last = frames_a_robot - 1;
  }
  const StreetGrid& town_;
};

// The map grows from nothing, a piece at a time. Routes must be right at once, and the cells well shaped.
TEST(Overlay, GrowsWithTheMap) {
  const StreetGrid town(small_town(5));
  SoFar map(town);
  Overlay overlay(kMetrics, CellStore::open_temporary().or_throw());
  overlay.build(map);
  std::mt19937_64 random(5);
  while (map.frames_a_robot < 3000) {
    const std::uint32_t before = map.frames_a_robot;
    map.frames_a_robot = std::min(3000u, before + 1 + static_cast<std::uint32_t>(random() % 150));
    std::set<storage::ChunkId> came;
    for (SessionNumber robot = 1; robot <= 6; ++robot)
      for (std::uint32_t index = before == 0 ? 0 : before - 1; index < map.frames_a_robot; ++index) {
        came.insert(storage::chunk_id({robot, index}));
        const auto known = town.recognised_at({robot, index});
        if (known && map.has(*known)) came.insert(storage::chunk_id(*known));
        const auto frame = map.hot({robot, index});
        for (const EdgeId loop : frame->incoming) came.insert(storage::chunk_id(loop.frame));
      }
    const std::vector<storage::ChunkId> changed(came.begin(), came.end());
    const auto ask = [&](std::span<const storage::ChunkId> stale) {
      for (int i = 0; i < 2; ++i) {
        OverlayQuery query;
        query.metric = random() % kMetrics.size();
        query.stale = stale;
        FrameId from = town.random_frame(random), to = town.random_frame(random);
        from.index = i == 0 ? map.frames_a_robot - 1 : from.index % map.frames_a_robot;
        to.index %= map.frames_a_robot;
        expect_as_dijkstra(overlay, map, query, from, to);
      }
    };
    ask(changed);
    overlay.refresh(map, changed);
    ask({});
    if (random() % 2) make_all(overlay);
    ask({});
  }
  make_all(overlay);
  const CellTree& tree = overlay.tree();
  EXPECT_EQ(tree.chunks(), 6u * 47);
  EXPECT_GE(tree.levels(), 2u);
  std::size_t borders = 0, borders_built = 0;
  for (std::uint32_t cell = 0; cell < tree.size(); ++cell) {
    EXPECT_FALSE(tree.has_too_many_parts(cell));
    for (const std::uint32_t part : tree.node(cell).children) {
      EXPECT_EQ(tree.parent(part), cell);
      EXPECT_EQ(tree.node(part).level + 1, tree.node(cell).level);
    }
    if (tree.node(cell).level == 1) borders += overlay.cell(cell)->nodes();
  }
  Overlay built(kMetrics, CellStore::open_temporary().or_throw());
  built.build(map);
  for (std::uint32_t cell = 0; cell < built.tree().size(); ++cell)
    if (built.tree().node(cell).level == 1) borders_built += built.cell(cell)->nodes();
  EXPECT_LT(static_cast<double>(borders), 1.5 * static_cast<double>(borders_built));
  // A copy does not change.
  const Overlay copy(overlay);
  const std::uint32_t last = copy.tree().find({1, 46});
  const StoredCell* const before = copy.cell(last);
  map.frames_a_robot = 46 * storage::kFramesPerChunk;
  const std::vector<storage::ChunkId> gone{{1, 46}};
  overlay.refresh(map, gone);
  EXPECT_EQ(copy.cell(last), before);
  EXPECT_NE(overlay.cell(last), before);
  EXPECT_EQ(copy.outdated(), 0u);
}

TEST(Overlay, AChangeThatAffectsNoPassageChangesNoCellAround) {
  StreetGrid town(small_town(5));
  Overlay overlay(kMetrics, CellStore::open_temporary().or_throw());
  overlay.build(town);
  const std::vector<storage::ChunkId> chunk{{3, 7}};
  EXPECT_EQ(overlay.refresh(town, chunk), 1u);
  EXPECT_EQ(overlay.outdated(), 0u) << "nothing had changed";
  town.set_length({3, 7 * storage::kFramesPerChunk + 20}, false, 1.1);
  EXPECT_EQ(overlay.refresh(town, chunk), 1u);
  EXPECT_EQ(overlay.outdated(), overlay.tree().levels() - 1) << "the cells around the chunk";
  EXPECT_EQ(overlay.cell(overlay.tree().around(overlay.tree().find({3, 7}), 1)), nullptr);
  make_all(overlay);
  EXPECT_NE(overlay.cell(overlay.tree().around(overlay.tree().find({3, 7}), 1)), nullptr);
  // A step between two chunks is an edge of both cells; the last chunk of a drive is not on any passage.
  town.set_length({3, 7 * storage::kFramesPerChunk}, false, 1.1);
  EXPECT_EQ(overlay.refresh(town, chunk), 2u);
  make_all(overlay);
  const std::vector<storage::ChunkId> tail{storage::chunk_id({3, 2999})};
  town.set_length({3, 2999}, false, 1.1);
  EXPECT_EQ(overlay.refresh(town, tail), 1u);
  EXPECT_EQ(overlay.outdated(), 0u);
  // A chunk that does not exist changes nothing, either.
  const std::vector<storage::ChunkId> beyond{{3, 1000}};
  overlay.refresh(town, beyond);
  EXPECT_EQ(overlay.tree().find({3, 1000}), CellTree::kNone);
}

TEST(Overlay, FiltersOpenTheCellsThatTheyRefuse) {
  StreetGridOptions options = small_town(6);
  options.oneway_share = 0.2;
  options.robots = 12;
  options.frames_a_robot = 1500;
  StreetGrid town(options);
  std::mt19937_64 random(6);
  for (int i = 0; i < 10; ++i) {
    FrameId frame = town.random_frame(random);
    frame.index = frame.index / 50 * 50;
    town.set_length(frame, true, 100);
  }
  Overlay overlay(kMetrics, CellStore::open_temporary().or_throw());
  overlay.build(town);
  int by_cells = 0, long_loops = 0;
  for (int query = 0; query < 120; ++query) {
    OverlayQuery asked;
    asked.metric = random() % kMetrics.size();
    RouteFilter& filter = asked.filter;
    if (random() % 2) filter.long_loops = false;
    if (random() % 2)
      for (int i = 0; i < 20; ++i) filter.avoided.insert(town.random_frame(random));
    if (random() % 4 == 0) filter.min_support = 20 + static_cast<std::uint32_t>(random() % 2);
    if (random() % 8 == 0) filter.sessions = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11};
    if (random() % 4 == 0) asked.max_cost = static_cast<double>(random() % 1000);
    auto opened = cells_to_open(overlay, filter);
    if (!opened) continue;
    ++by_cells;
    long_loops += !filter.long_loops;
    asked.opened = *std::move(opened);
    expect_as_dijkstra(overlay, town, asked, town.random_frame(random), town.random_frame(random));
    if (!filter.avoided.empty())
      expect_as_dijkstra(overlay, town, asked, *filter.avoided.begin(), town.random_frame(random));
  }
  EXPECT_GT(by_cells, 40);
  EXPECT_GT(long_loops, 20);
  RouteFilter filter;
  filter.supposed.candidates = true;
  EXPECT_FALSE(cells_to_open(overlay, filter).has_value());
  filter = {};
  filter.supposed.bound = true;
  EXPECT_TRUE(cells_to_open(overlay, filter).value().empty()) << "cells are passed without closures that only bind";
  filter = {};
  filter.min_support = 60;
  EXPECT_FALSE(cells_to_open(overlay, filter).has_value()) << "it refuses edges everywhere";
}

TEST(Overlay, FindsTheBestOfSeveralFramesAtEitherEnd) {
  const StreetGrid town(small_town(6));
  Overlay overlay(kMetrics, CellStore::open_temporary().or_throw());
  overlay.build(town);
  std::mt19937_64 random(6);
  for (int query = 0; query < 50; ++query) {
    std::vector<FrameId> from, to;
    for (std::size_t i = 0; i < 1 + random() % 4; ++i) from.push_back(town.random_frame(random));
    for (std::size_t i = 0; i < 1 + random() % 4; ++i) to.push_back(town.random_frame(random));
    const auto expected = find_route(town, from, to, RouteOptions{.weights = kMetrics[0]}).or_throw();
    const auto found = find_route(overlay, town, OverlayQuery(), from, to).or_throw();
    EXPECT_NEAR(found.cost, expected.cost, 1e-9 * expected.cost);
    EXPECT_NE(std::find(from.begin(), from.end(), found.from), from.end());
    EXPECT_NE(std::find(to.begin(), to.end(), found.to), to.end());
  }
  const std::vector<FrameId> here{{2, 100}};
  EXPECT_EQ(find_route(overlay, town, OverlayQuery(), here, here).or_throw().cost, 0);
  EXPECT_EQ(find_route(overlay, town, OverlayQuery(), here, std::vector<FrameId>{{9, 1}}).reason(),
            Reason::NO_SUCH_FRAME);
}

TEST(Overlay, EndsWithItsWork) {
  const StreetGrid town(small_town(7));
  Overlay overlay(kMetrics, CellStore::open_temporary().or_throw());
  overlay.build(town);
  // `proceed` may end it at any call: in the search, while the route is unpacked, and while it is followed.
  const std::vector<FrameId> here{{1, 5}}, there{{6, 2900}};
  std::size_t asked = 0, enough = 0;
  const WorkLimit work{
      .proceed = [&](std::size_t) { return ++asked > enough ? Status(Reason::DEADLINE, "enough") : Status(); }};
  const auto search = [&]() -> Result<Route> {
    asked = 0;
    auto found = find_route(overlay, town, OverlayQuery(), here, there, work);
    if (!found.ok()) return found.status();
    if (Status status = unpack(overlay, town, 0, *found, work); !status.ok()) return status;
    return follow(overlay, town, 0, *found, false, work);
  };
  const auto route = [&]() -> Result<Route> {
    try {
      return search();
    } catch (const StatusError& error) {
      return error.status();
    }
  };
  for (; !route().ok(); ++enough) EXPECT_EQ(route().reason(), Reason::DEADLINE);
  EXPECT_GT(enough, 5u);
  const std::vector<storage::ChunkId> stale{{2, 5}, {3, 5}};
  OverlayQuery query;
  query.stale = stale;
  asked = enough = 0;
  EXPECT_THROW(find_route(overlay, town, query, here, there, work), StatusError);
  WorkLimit few;
  few.max_frames = 3;
  EXPECT_EQ(find_route(overlay, town, OverlayQuery(), here, there, few).reason(), Reason::OUT_OF_REACH);
}

// A map with everything that a town lacks: gaps, missing frames, edges of zero or equal length, several edges between
// two frames, edges within a chunk and from a frame to itself, sessions without edges to others.
class TangledGraph final : public storage::PartialGraph {
 public:
  explicit TangledGraph(std::mt19937& random, int loops = 120) {
    for (SessionNumber session = 1; session <= 4; ++session) {
      FrameId before;
      std::uint32_t index = static_cast<std::uint32_t>(random() % 100);
      for (int i = 0; i < 150; ++i) {
        const FrameId frame{session, index};
        frames_[frame] = std::make_shared<storage::FrameHot>();
        frames_[frame]->present = true;
        if (before.valid()) join(before, frame, storage::EdgeKind::kOdometry, random);
        before = frame;
        ids_.push_back(frame);
        index += random() % 12 ? 1 : static_cast<std::uint32_t>(1 + random() % 300);
      }
    }
    for (int i = 0; i < loops; ++i) {
      const FrameId a = ids_[random() % ids_.size()];
      const FrameId b = random() % 3 ? ids_[random() % ids_.size()] : near(a, random);
      if (a.session == 4 || b.session == 4) continue;  // session 4 has no edges to others
      for (std::size_t n = 1 + random() % 2; n > 0; --n)
        join(std::min(a, b), std::max(a, b), storage::EdgeKind::kLoop, random);
    }
    for (auto& [id, frame] : frames_) std::sort(frame->incoming.begin(), frame->incoming.end());
  }
  const std::vector<FrameId>& ids() const { return ids_; }
  // Changes every edge at some frames.
  std::vector<storage::ChunkId> change(std::mt19937& random) {
    std::set<storage::ChunkId> changed;
    for (int i = 0; i < 10; ++i) {
      const auto& frame = frames_.at(ids_[random() % ids_.size()]);
      for (storage::Edge& edge : frame->edges) {
        edge.T_ab.t = {0, 0, static_cast<double>(random() % 4)};
        if (edge.kind == storage::EdgeKind::kLoop)
          edge.state = random() % 3 ? storage::EdgeState::kAccepted : storage::EdgeState::kRemoved;
        changed.insert({storage::chunk_id(edge.a), storage::chunk_id(edge.b)});
      }
    }
    return {changed.begin(), changed.end()};
  }

  std::shared_ptr<const storage::FrameHot> hot(FrameId id) const override {
    if (fail_) throw StatusError(Status(Reason::IO_ERROR, "the disk"));
    const auto found = frames_.find(id);
    return found == frames_.end() ? nullptr : found->second;
  }
  std::vector<storage::Session> all_sessions() const override {
    return {*session(1), *session(2), *session(3), *session(4)};
  }
  std::optional<storage::Session> session(SessionNumber number) const override {
    storage::Session session;
    session.number = number;
    session.header.oneway = number == 2;
    session.frames = 150;
    session.first = frames_.lower_bound({number, 0})->first.index;
    session.last = std::prev(frames_.lower_bound({number + 1, 0}))->first.index;
    return session;
  }

  bool fail_ = false;

 private:
  FrameId near(FrameId frame, std::mt19937& random) const {
    const auto at = static_cast<std::size_t>(std::find(ids_.begin(), ids_.end(), frame) - ids_.begin());
    return ids_[std::min(ids_.size() - 1, at + random() % 20)];
  }
  void join(FrameId a, FrameId b, storage::EdgeKind kind, std::mt19937& random) {
    storage::FrameHot& newer = *frames_.at(b);
    storage::Edge edge;
    edge.id = {b, kind == storage::EdgeKind::kLoop ? newer.next_loop_ordinal++ : 0u};
    edge.a = a;
    edge.b = b;
    edge.kind = kind;
    edge.T_ab.t = {0, 0, random() % 50 == 0 ? 9.0 : static_cast<double>(random() % 4)};
    edge.driven_s = static_cast<float>(random() % 3);
    edge.support = random() % 40 == 0 ? 1 : 5;
    newer.edges.push_back(edge);
    frames_.at(a)->incoming.push_back(edge.id);
  }
  std::map<FrameId, std::shared_ptr<storage::FrameHot>> frames_;
  std::vector<FrameId> ids_;
};

TEST(Overlay, FindsWhatDijkstraFindsInATangle) {
  std::mt19937 random(8);
  for (int trial = 0; trial < 8; ++trial) {
    TangledGraph graph(random);
    Overlay overlay(kMetrics, CellStore::open_temporary().or_throw());
    overlay.build(graph);
    for (int round = 0; round < 4; ++round) {
      for (int query = 0; query < 60; ++query)
        expect_as_dijkstra(overlay, graph, random() % kMetrics.size(), graph.ids()[random() % graph.ids().size()],
                           graph.ids()[random() % graph.ids().size()]);
      const std::vector<storage::ChunkId> changed = graph.change(random);
      for (int query = 0; query < 20; ++query) {
        OverlayQuery asked;
        asked.metric = random() % kMetrics.size();
        asked.stale = changed;
        if (random() % 2) asked.filter.min_support = 2;
        if (random() % 2) asked.filter.avoided = {graph.ids()[random() % graph.ids().size()]};
        if (random() % 2) asked.filter.long_loops = false;
        auto opened = cells_to_open(overlay, asked.filter);
        if (!opened) continue;
        asked.opened = *std::move(opened);
        expect_as_dijkstra(overlay, graph, asked, graph.ids()[random() % graph.ids().size()],
                           graph.ids()[random() % graph.ids().size()]);
      }
      overlay.refresh(graph, changed);
      if (round % 2) make_all(overlay);
    }
  }
}

// What edges join to a frame in either direction, found frame by frame.
std::set<FrameId> joined_to(const storage::Graph& graph, FrameId from) {
  std::set<FrameId> reached{from};
  for (std::vector<FrameId> open{from}; !open.empty();) {
    const FrameId frame = open.back();
    open.pop_back();
    const CellFrames frames = frames_of(graph, storage::chunk_id(frame));
    for (const Link& link : frames.links_of(frames.find(frame)))
      if (reached.insert(link.to).second) open.push_back(link.to);
  }
  return reached;
}

TEST(Reachability, EqualsASearchFrameByFrame) {
  std::mt19937 random(10);
  int apart = 0, together = 0;
  for (int trial = 0; trial < 12; ++trial) {
    TangledGraph graph(random, trial * 2);
    Overlay overlay(kMetrics, CellStore::open_temporary().or_throw());
    overlay.build(graph);
    std::vector<storage::ChunkId> changed;
    for (int round = 0; round < 4; ++round) {
      for (int query = 0; query < 30; ++query) {
        const std::vector<FrameId> from{graph.ids()[random() % graph.ids().size()]},
            to{graph.ids()[random() % graph.ids().size()]};
        const Reachability joined(overlay, graph, changed, from, to);
        const std::set<FrameId> expected = joined_to(graph, from[0]);
        std::set<SessionNumber> sessions;
        for (const FrameId frame : expected) sessions.insert(frame.session);
        EXPECT_EQ(joined.sessions(), sessions);
        EXPECT_EQ(joined.goal(), expected.contains(to[0]));
        ++(joined.goal() ? together : apart);
      }
      if (round == 0) {
        changed = graph.change(random);
      } else if (round == 1) {
        overlay.refresh(graph, changed);
        changed.clear();
      } else {
        make_all(overlay);
      }
    }
  }
  EXPECT_GT(apart, 100);
  EXPECT_GT(together, 100);
}

TEST(Reachability, LooksIntoFewCells) {
  const StreetGrid town(small_town(4));
  Overlay overlay(kMetrics, CellStore::open_temporary().or_throw());
  overlay.build(town);
  EXPECT_GT(overlay.tree().chunks(), 250u);
  int looks = 0;
  WorkLimit work;
  work.proceed = [&](std::size_t) {
    ++looks;
    return Status();
  };
  const std::vector<FrameId> from{{1, 0}}, to{{2, 2999}};
  const Reachability joined(overlay, town, {}, from, to, work);
  EXPECT_TRUE(joined.goal());
  EXPECT_EQ(joined.sessions().size(), 6u);
  EXPECT_LE(looks, 5) << "two for the ends, and each 64 cells, twice";
}

TEST(Overlay, ACellThatCannotBeReadIsMadeAtTheNextTry) {
  std::mt19937 random(9);
  TangledGraph graph(random);
  Overlay overlay(kMetrics, CellStore::open_temporary().or_throw());
  overlay.build(graph);
  const std::vector<storage::ChunkId> changed = graph.change(random);
  graph.fail_ = true;
  EXPECT_THROW(overlay.refresh(graph, changed), StatusError);
  graph.fail_ = false;
  overlay.refresh(graph, changed);
  for (int query = 0; query < 100; ++query)
    expect_as_dijkstra(overlay, graph, random() % kMetrics.size(), graph.ids()[random() % graph.ids().size()],
                       graph.ids()[random() % graph.ids().size()]);
}

TEST(Overlay, NeedsValidWeights) {
  EXPECT_THROW(Overlay({}, nullptr), StatusError);
  EXPECT_THROW(Overlay({kByDistance, {-1, 1, 0, 0}}, nullptr), StatusError);
}

// Sessions that no edges join, and maps smaller than a cell.
TEST(Overlay, FindsNoRouteBetweenPartsThatNoEdgesJoin) {
  DrawnMap map(R"(
    A---B---C

    E---D---F
  )");
  map.drive("ABC");
  map.drive("EDF");
  Overlay overlay(kMetrics, CellStore::open_temporary().or_throw());
  overlay.build(map);
  expect_as_dijkstra(overlay, map, 0, map.id('A'), map.id('C'));
  expect_as_dijkstra(overlay, map, 0, map.id('A'), map.id('D'));
  const std::vector<FrameId> a{map.id('A')}, d{map.id('D')};
  EXPECT_EQ(find_route(overlay, map, OverlayQuery(), a, d).status().message(),
            find_route(map, a, d).status().message());
  map.close("CE");
  const std::vector<storage::ChunkId> changed{{1, 0}, {2, 0}};
  overlay.refresh(map, changed);
  expect_as_dijkstra(overlay, map, 0, map.id('A'), map.id('F'));
}

TEST(CostMatrix, EliminationKeepsTheCostsOfAllPaths) {
  std::mt19937 random(1);
  for (int trial = 0; trial < 50; ++trial) {
    const std::size_t n = 1 + random() % 40, kept = random() % (n + 1);
    CostMatrix whole(n);
    for (std::size_t i = 0; i < 3 * n; ++i) whole.offer(random() % n, random() % n, 1 + random() % 100);
    CostMatrix reduced = whole;
    whole.close();
    reduced.eliminate(kept);
    ASSERT_EQ(reduced.size(), kept);
    reduced.close();
    for (std::size_t i = 0; i < kept; ++i)
      for (std::size_t j = 0; j < kept; ++j) EXPECT_EQ(reduced(i, j), whole(i, j));
    EXPECT_EQ(whole.transposed().transposed(), whole);
  }
}

TEST(CostMatrix, SplitKeepsAlmostAllOfEachCost) {
  std::mt19937 random(3);
  CostMatrix whole(30);
  for (int i = 0; i < 800; ++i)
    whole.offer(random() % 30, random() % 30, std::ldexp(static_cast<double>(random()) / 3, int(random() % 60) - 40));
  const SplitCostMatrix split(whole);
  for (std::size_t i = 0; i < 30; ++i)
    for (std::size_t j = 0; j < 30; ++j) {
      EXPECT_LE(split.floors(i)[j], whole(i, j));
      if (whole(i, j) == kUnreachable)
        EXPECT_EQ(split(i, j), kUnreachable);
      else
        EXPECT_NEAR(split(i, j), whole(i, j), 2e-12 * whole(i, j));
    }
  EXPECT_EQ(SplitCostMatrix(split.whole()), split);

  // Values at and beyond the range of a float.
  CostMatrix ends(3);
  ends.offer(0, 1, std::numeric_limits<double>::max());
  ends.offer(0, 2, std::numeric_limits<double>::min());
  ends.offer(1, 0, std::numeric_limits<float>::max());
  ends.offer(1, 2, 4.0);
  ends.offer(2, 0, std::nextafter(4.0, 5.0));
  ends.offer(2, 1, std::nextafter(4.0, 3.0));
  const SplitCostMatrix at_ends(ends);
  EXPECT_EQ(at_ends(0, 1), std::numeric_limits<float>::max());
  EXPECT_EQ(at_ends(0, 2), 0.0);
  EXPECT_EQ(at_ends(1, 0), std::numeric_limits<float>::max());
  EXPECT_EQ(at_ends(1, 2), 4.0);
  EXPECT_EQ(at_ends(2, 0), 4.0);
  EXPECT_NEAR(at_ends(2, 1), 4.0, 1e-11);
}

TEST(Labels, RelaxingARowEqualsRelaxingOneByOne) {
  std::mt19937 random(2);
  for (int trial = 0; trial < 200; ++trial) {
    const std::size_t n = 1 + random() % 50;
    Labels labels(n), by_hand(n);
    std::vector<double> other(n);
    for (double& value : other) value = random() % 3 ? 1 + random() % 50 : kUnreachable;
    for (std::uint64_t from = 0; from < 10; ++from) {
      CostMatrix costs(n);
      for (std::size_t j = 0; j < n; ++j)
        costs.row(0)[j] = random() % 5 ? 1 + static_cast<double>(random() % 1000) / 7 : kUnreachable;
      const SplitCostMatrix split(costs);
      costs = split.whole();
      const double* row = costs.row(0);
      const double cost = random() % 40;
      double whole = kUnreachable;
      for (std::size_t j = 0; j < n; ++j) {
        if (cost + row[j] >= by_hand.cost[j]) continue;
        by_hand.cost[j] = by_hand.pending[j] = cost + row[j];
        by_hand.came[j] = from;
        whole = std::min(whole, cost + row[j] + other[j]);
      }
      EXPECT_EQ(relax_row(split.floors(0), split.rests(0), cost, from, other.data(), labels), whole);
      EXPECT_TRUE(std::ranges::equal(labels.cost, by_hand.cost));
      EXPECT_TRUE(std::ranges::equal(labels.pending, by_hand.pending));
      for (std::size_t j = 0; j < n; ++j)
        EXPECT_TRUE(labels.cost[j] == kUnreachable || labels.came[j] == by_hand.came[j]);
      EXPECT_EQ(labels.min_pending, *std::min_element(by_hand.pending.begin(), by_hand.pending.end()));

      const double until = labels.min_pending + random() % 20;
      std::vector<std::uint32_t> due, due_by_hand;
      take_pending(until, labels, due);
      for (std::uint32_t j = 0; j < n; ++j)
        if (by_hand.pending[j] <= until) due_by_hand.push_back(j), by_hand.pending[j] = kUnreachable;
      EXPECT_EQ(due, due_by_hand);
      EXPECT_TRUE(std::ranges::equal(labels.pending, by_hand.pending));
    }
  }
}

TEST(CellTree, DividesAllChunksIntoNestedCells) {
  std::vector<storage::ChunkId> chunks;
  std::vector<WeightedPair> ties;
  for (std::uint32_t c = 0; c < 3000; ++c) {
    chunks.push_back({1 + c / 1000, c % 1000});
    if (c % 1000 != 0) ties.push_back({c - 1, c, 1});
  }
  const CellTree tree(chunks, ties);
  std::vector<int> seen(chunks.size());
  for (std::uint32_t cell = 0; cell < tree.size(); ++cell)
    for (const std::uint32_t child : tree.node(cell).children) {
      EXPECT_LT(child, cell);
      EXPECT_EQ(tree.parent(child), cell);
      EXPECT_EQ(tree.node(child).level + 1, tree.node(cell).level);
      if (child < chunks.size()) ++seen[child];
    }
  EXPECT_EQ(std::count(seen.begin(), seen.end(), 1), 3000);
  EXPECT_GE(tree.levels(), 3u);
  for (std::uint32_t c = 0; c < chunks.size(); ++c) {
    EXPECT_EQ(tree.find(chunks[c]), c);
    EXPECT_EQ(tree.around(c, 0), c);
    EXPECT_EQ(tree.parent(tree.around(c, tree.levels() - 1)), tree.root());
  }
  EXPECT_EQ(tree.find({4, 0}), CellTree::kNone);
  EXPECT_EQ(tree.find({1, 1000}), CellTree::kNone);
}

}  // namespace
}  // namespace relmap::route
