#include "server/route/dijkstra.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>

#include "server/route/testing/drawn_map.h"
#include "storage/testing/endless_drive.h"

namespace relmap::route {
namespace {

std::vector<RouteStep> steps_of(const storage::Graph& graph, const Route& route) {
  std::vector<RouteStep> steps;
  for (RouteWalk walk(graph, route); auto step = walk.next();) steps.push_back(*std::move(step));
  return steps;
}

// The frames of a route as letters, or the reason why there is none.
std::string route(const DrawnMap& map, std::string_view from, std::string_view to, const RouteOptions& options = {},
                  const WorkLimit& work = {}) {
  std::vector<FrameId> starts, goals;
  for (const char c : from) starts.push_back(map.id(c));
  for (const char c : to) goals.push_back(map.id(c));
  const auto found = find_route(map, starts, goals, options, work);
  if (!found.ok()) return std::string(reason_name(found.reason()));
  std::string names;
  for (const RouteStep& step : steps_of(map, *found)) names += map.name(step.frame);
  return names;
}

const RouteOptions kQuickest{.weights = kByTime};

TEST(Route, FollowsTheDriveWhereThereIsNoOtherRoute) {
  DrawnMap map(R"(
    A---B---C
            |
    E-------D
  )");
  map.drive("ABCDE");
  EXPECT_EQ(route(map, "A", "E"), "ABCDE");
  EXPECT_EQ(route(map, "E", "A"), "EDCBA");
  EXPECT_EQ(route(map, "C", "C"), "C");
}

TEST(Route, TakesALoopEdgeAsAShortCut) {
  DrawnMap map(R"(
    A---B---C
    .       |
    E-------D
  )");
  map.drive("ABCDE");
  map.close("AE");
  EXPECT_EQ(route(map, "A", "E"), "AE");
  EXPECT_EQ(route(map, "B", "E"), "BAE");
  EXPECT_EQ(route(map, "B", "D"), "BCD");
}

TEST(Route, LeavesOutEdgesThatAreNotAcceptedOrDoNotCarry) {
  DrawnMap map(R"(
    A---B---C
    .       |
    E-------D
  )");
  map.drive("ABCDE");
  const EdgeId loop = map.close("AE");
  for (const storage::EdgeState state :
       {storage::EdgeState::kCandidate, storage::EdgeState::kQuarantined, storage::EdgeState::kRemoved}) {
    map.set_state(loop, state);
    EXPECT_EQ(route(map, "A", "E"), "ABCDE");
  }
  map.set_state(loop, storage::EdgeState::kAccepted);
  map.editable(loop.frame).edge(loop)->carries = false;
  EXPECT_EQ(route(map, "A", "E"), "ABCDE");
}

TEST(Route, ShortestAndFastestMayDiffer) {
  // The direct route is slow, the detour fast.
  DrawnMap map(R"(
    A-----B
    |     |
    C     D
    |     |
    E-----F
  )");
  map.drive("AB", {.metres_per_second = 0.1});
  map.drive("CEFD", {.metres_per_second = 10});
  map.close("AC", 1);
  map.close("BD", 1);
  EXPECT_EQ(route(map, "A", "B"), "AB");
  EXPECT_EQ(route(map, "A", "B", kQuickest), "ACEFDB");
}

TEST(Route, TimeCountsStandingOnlyIfAsked) {
  DrawnMap map(R"(
    A---B---C
    |       |
    D-------E
  )");
  map.drive("ABC", {.standing_s = 60});
  map.drive("DE", {.metres_per_second = 0.5});
  map.close("AD", 2);
  map.close("CE", 2);
  EXPECT_EQ(route(map, "A", "C", kQuickest), "ABC");
  EXPECT_EQ(route(map, "A", "C", {.weights = kByTimeStandingToo}), "ADEC");

  const std::vector<FrameId> a{map.id('A')}, c{map.id('C')};
  EXPECT_NEAR(find_route(map, a, c, kQuickest)->time_s, 8, 1e-6);
  EXPECT_NEAR(find_route(map, a, c, kQuickest)->distance_m, 8, 1e-9);
}

TEST(Route, OnewaySessionsAreTravelledOnlyAsDriven) {
  DrawnMap map(R"(
    A---B---C
    .       |
    F---E---D
  )");
  map.drive("ABCDEF", {.oneway = true});
  EXPECT_EQ(route(map, "A", "F"), "ABCDEF");
  EXPECT_EQ(route(map, "B", "A"), "NOT_CONNECTED");
  map.close("AF");
  EXPECT_EQ(route(map, "B", "A"), "BCDEFA");  // on to the end and round
}

TEST(Route, ManyEndsGiveTheNearestPair) {
  DrawnMap map(R"(
    A--B-----C--D----E---F
  )");
  map.drive("ABCDEF");
  EXPECT_EQ(route(map, "AB", "DF"), "BCD");
  EXPECT_EQ(route(map, "BE", "AF"), "BA");
}

TEST(Route, ARefusalNamesTheSessionsThatAreNotConnected) {
  DrawnMap map(R"(
    A---B   C---D   E---F
  )");
  map.drive("AB");
  map.drive("CD");
  map.drive("EF");
  map.close("BC");
  EXPECT_EQ(route(map, "A", "D"), "ABCD");
  const std::vector<FrameId> a{map.id('A')}, f{map.id('F')};
  const auto found = find_route(map, a, f);
  ASSERT_FALSE(found.ok());
  EXPECT_EQ(found.reason(), Reason::NOT_CONNECTED);
  EXPECT_NE(found.status().message().find("1 (drive1), 2 (drive2); the goal is in session(s) 3 (drive3)"),
            std::string::npos)
      << found.status().message();
}

TEST(Route, LimitsOfCostAndWorkHaveTheirOwnReasons) {
  DrawnMap map(R"(
    A---B---C---D---E
  )");
  map.drive("ABCDE");
  EXPECT_EQ(route(map, "A", "E", {.max_cost = 16}), "ABCDE");
  EXPECT_EQ(route(map, "A", "E", {.max_cost = 15}), "COST_LIMIT");
  EXPECT_EQ(route(map, "A", "E", {}, {.max_frames = 3, .proceed = {}}), "OUT_OF_REACH");
  EXPECT_EQ(route(map, "A", "E", {}, {.proceed = [](std::size_t) { return Status(Reason::DEADLINE, ""); }}),
            "DEADLINE");
}

TEST(Route, AnUnknownFrameIsNamed) {
  DrawnMap map("A-B");
  map.drive("AB");
  const std::vector<FrameId> a{map.id('A')}, nowhere{{7, 7}};
  EXPECT_EQ(find_route(map, a, nowhere).reason(), Reason::NO_SUCH_FRAME);
  EXPECT_EQ(find_route(map, nowhere, a).reason(), Reason::NO_SUCH_FRAME);
  EXPECT_EQ(find_route(map, a, {}).reason(), Reason::INVALID_ARGUMENT);
}

TEST(Route, StepsCarryTransformsLabelsAndFlags) {
  DrawnMap map(R"(
    A---B      C---D
  )");
  map.drive("AB");
  map.drive("CD");
  const EdgeId loop = map.close("BC");
  map.label('B', "dock");
  const std::vector<FrameId> d{map.id('D')}, a{map.id('A')};
  const auto found = find_route(map, d, a);
  ASSERT_TRUE(found.ok());
  const std::vector<RouteStep> steps = steps_of(map, *found);
  ASSERT_EQ(steps.size(), 4u);
  EXPECT_EQ(found->steps(), 4u);
  EXPECT_EQ(found->long_loops, 1u);
  EXPECT_EQ(steps[1].edge, loop);
  EXPECT_TRUE(steps[1].long_loop);
  EXPECT_FALSE(steps[0].long_loop);
  EXPECT_EQ(steps[2].labels, std::vector<std::string>{"dock"});
  EXPECT_FALSE(steps[3].edge.valid());

  SE3 T;
  for (const RouteStep& step : steps) {
    EXPECT_NEAR(step.distance_m, (map.position('D') - map.position(map.name(step.frame))).norm(), 1e-9);
    T = T * step.T_to_next;
  }
  EXPECT_TRUE(T.t.isApprox(map.position('A') - map.position('D'), 1e-12));
}

// Random maps against Floyd and Warshall.
TEST(Route, EqualsBruteForceOnRandomMaps) {
  std::mt19937 random(7);
  const std::string names = "ABCDEFGHIJKLMNOPQRSTUVWXYZ";
  for (int trial = 0; trial < 40; ++trial) {
    DrawnMap map("");
    std::uniform_real_distribution<double> coordinate(0, 100);
    for (const char c : names) map.place(c, {coordinate(random), coordinate(random), coordinate(random)});
    for (int s = 0; s < 4; ++s)
      map.drive(
          names.substr(static_cast<std::size_t>(s) * 6, 6),
          {.metres_per_second = 0.1 + coordinate(random), .standing_s = coordinate(random), .oneway = s % 2 == 1});
    for (int l = 0; l < 8; ++l) {
      const char a = names[random() % 24], b = names[random() % 24];
      if (a != b) map.close(std::string{a, b}, coordinate(random));
    }
    const RouteWeights choices[] = {kByDistance, kByTimeStandingToo, {1, 0.3, 0.1, 50}, kByTime};
    const RouteOptions options{.weights = choices[trial % 4]};

    constexpr double kFar = 1e18;
    std::vector<std::vector<double>> cost(24, std::vector<double>(24, kFar));
    for (std::size_t i = 0; i < 24; ++i) cost[i][i] = 0;
    for (std::size_t i = 0; i < 24; ++i) {
      for (const storage::Edge& e : map.hot(map.id(names[i]))->edges) {
        const std::size_t a = names.find(map.name(e.a)), b = names.find(map.name(e.b));
        const double w = options.weights(costs(e));
        cost[a][b] = std::min(cost[a][b], w);
        if (e.kind == storage::EdgeKind::kLoop || e.b.session % 2 == 1) cost[b][a] = std::min(cost[b][a], w);
      }
    }
    for (std::size_t k = 0; k < 24; ++k)
      for (std::size_t i = 0; i < 24; ++i)
        for (std::size_t j = 0; j < 24; ++j) cost[i][j] = std::min(cost[i][j], cost[i][k] + cost[k][j]);

    for (std::size_t i = 0; i < 24; ++i) {
      for (std::size_t j = 0; j < 24; ++j) {
        const std::vector<FrameId> from{map.id(names[i])}, to{map.id(names[j])};
        const auto found = find_route(map, from, to, options);
        if (cost[i][j] == kFar) {
          EXPECT_EQ(found.reason(), Reason::NOT_CONNECTED);
          continue;
        }
        ASSERT_TRUE(found.ok()) << found.status().to_string();
        EXPECT_NEAR(found->cost, cost[i][j], 1e-9 * (1 + cost[i][j]));
      }
    }
  }
}

RouteOptions filtered(RouteFilter filter) { return {.weights = {}, .filter = std::move(filter)}; }

TEST(RouteFilter, AvoidsFramesAndKeepsToSessions) {
  DrawnMap map(R"(
    A---B---C
    |       |
    F---G---H
  )");
  map.drive("ABC");
  map.drive("FGH");
  map.close("AF");
  map.close("CH");
  RouteFilter filter;
  EXPECT_EQ(route(map, "A", "C", filtered(filter)), "ABC");
  filter.avoided = {map.id('B')};
  EXPECT_EQ(route(map, "A", "C", filtered(filter)), "AFGHC");
  filter.avoided.insert(map.id('G'));
  EXPECT_EQ(route(map, "A", "C", filtered(filter)), "NOT_CONNECTED");
  const std::vector<FrameId> a{map.id('A')}, c{map.id('C')};
  EXPECT_NE(find_route(map, a, c, filtered(filter)).status().message().find("to be avoided"), std::string::npos);
  filter = {};
  filter.sessions = {2};
  EXPECT_EQ(route(map, "F", "H", filtered(filter)), "FGH");
  EXPECT_EQ(route(map, "A", "H", filtered(filter)), "NOT_CONNECTED") << "it begins outside";
  EXPECT_NE(find_route(map, a, c, filtered(filter)).status().message().find("the start is not in the sessions"),
            std::string::npos);
  filter.sessions = {1, 2};
  EXPECT_EQ(route(map, "A", "G", filtered(filter)), "AFG");
}

TEST(RouteFilter, LongLoopsAndWeakEdgesCanBeLeftOut) {
  DrawnMap map(R"(
    A-------B
    |       |
    D-------C
  )");
  map.drive("ABCD");
  const EdgeId shortcut = map.close("AD");
  const auto length = storage::find_edge(map, shortcut)->T_ab.t.norm();
  ASSERT_LT(length, kLongLoopMetres);
  EXPECT_EQ(route(map, "A", "D"), "AD");
  RouteFilter filter;
  filter.long_loops = false;
  EXPECT_EQ(route(map, "A", "D", filtered(filter)), "AD") << "it is not long";
  map.editable(map.id('D')).edge(shortcut)->T_ab.t *= 6 / length;
  EXPECT_EQ(route(map, "A", "D", filtered(filter)), "ABCD");
  EXPECT_EQ(route(map, "A", "D"), "AD");

  for (const char frame : std::string("BCD"))
    for (storage::Edge& edge : map.editable(map.id(frame)).edges) edge.support = edge.id == shortcut ? 19 : 20;
  filter = {};
  filter.min_support = 20;
  EXPECT_EQ(route(map, "A", "D", filtered(filter)), "ABCD");
  filter.min_support = 21;
  EXPECT_EQ(route(map, "A", "D", filtered(filter)), "NOT_CONNECTED");
}

TEST(RouteFilter, AClosureMayBeSupposedToBeInForce) {
  DrawnMap map(R"(
    A---B---C
    |       |
    F---E---D
  )");
  map.drive("ABCDEF");
  const EdgeId closure = map.close("AF");
  RouteFilter candidates, quarantined;
  candidates.supposed.candidates = true;
  quarantined.supposed.quarantined = true;
  storage::Edge& stored = *map.editable(map.id('F')).edge(closure);
  stored.verification = storage::Verification::kStereo;
  map.set_state(closure, storage::EdgeState::kCandidate);
  EXPECT_EQ(route(map, "A", "F"), "ABCDEF");
  EXPECT_EQ(route(map, "A", "F", filtered(candidates)), "AF") << "and its steps can be walked";
  EXPECT_EQ(route(map, "F", "B", filtered(candidates)), "FAB");
  EXPECT_EQ(route(map, "A", "F", filtered(quarantined)), "ABCDEF");
  map.set_state(closure, storage::EdgeState::kQuarantined);
  EXPECT_EQ(route(map, "A", "F", filtered(quarantined)), "AF");
  map.set_state(closure, storage::EdgeState::kRemoved);
  candidates.supposed.quarantined = true;
  EXPECT_EQ(route(map, "A", "F", filtered(candidates)), "ABCDEF") << "what was taken out is never supposed";
  map.set_state(closure, storage::EdgeState::kCandidate);
  candidates.min_support = 1;
  for (const char frame : std::string("BCDEF"))
    for (storage::Edge& edge : map.editable(map.id(frame)).edges) edge.support = edge.id == closure ? 0 : 1;
  EXPECT_EQ(route(map, "A", "F", filtered(candidates)), "AF") << "it could have no support yet";
  stored.verification = storage::Verification::kEpipolar;
  EXPECT_EQ(route(map, "A", "F", filtered(candidates)), "ABCDEF") << "nobody knows how long it is";
}

// Two views of one place that are too close along the graph for a loop edge.
TEST(RouteFilter, ClosuresThatOnlyBindMayBeSupposedToBeEdges) {
  DrawnMap map(R"(
    A---B---C
    |       |
    F---E---D
  )");
  map.drive("ABCDEF", {.oneway = true});
  const EdgeId closure = map.close("AF");
  storage::Edge& stored = *map.editable(map.id('F')).edge(closure);
  stored.carries = false;
  stored.verification = storage::Verification::kStereo;
  RouteFilter filter;
  EXPECT_EQ(route(map, "A", "F", filtered(filter)), "ABCDEF");
  filter.supposed.bound = true;
  EXPECT_EQ(route(map, "A", "F", filtered(filter)), "AF") << "and its steps can be walked";
  EXPECT_EQ(route(map, "E", "B", filtered(filter)), "EFAB") << "nobody drove it: it leads both ways";
  EXPECT_EQ(route(map, "D", "C", filtered(filter)), "DEFABC") << "what was driven one way still does not";
  const std::vector<FrameId> e{map.id('E')}, b{map.id('B')};
  const auto steps = steps_of(map, find_route(map, e, b, filtered(filter)).or_throw());
  EXPECT_EQ(steps.at(1).edge, closure);
  EXPECT_EQ(steps.at(1).kind, storage::EdgeKind::kLoop);
  EXPECT_EQ(route(map, "A", "F", {.weights = {}, .max_cost = 1, .filter = filter}), "COST_LIMIT");

  filter.avoided = {map.id('A')};
  EXPECT_EQ(route(map, "E", "B", filtered(filter)), "NOT_CONNECTED");
  filter.avoided.clear();
  for (const char frame : std::string("BCDEF")) map.editable(map.id(frame)).edges.front().support = 20;
  filter.min_support = 1;
  EXPECT_EQ(route(map, "A", "F", filtered(filter)), "ABCDEF") << "no observation's path leads over it";
  filter.min_support = 0;
  const Vector3 short_way = stored.T_ab.t;
  stored.T_ab.t *= 6 / short_way.norm();
  EXPECT_EQ(route(map, "A", "F", filtered(filter)), "AF");
  filter.long_loops = false;
  EXPECT_EQ(route(map, "A", "F", filtered(filter)), "ABCDEF");
  stored.T_ab.t = short_way;
  EXPECT_EQ(route(map, "A", "F", filtered(filter)), "AF");

  stored.verification = storage::Verification::kEpipolar;
  EXPECT_EQ(route(map, "A", "F", filtered(filter)), "ABCDEF") << "nobody knows how long it is";
  stored.verification = storage::Verification::kStereo;
  for (const storage::EdgeState state :
       {storage::EdgeState::kCandidate, storage::EdgeState::kQuarantined, storage::EdgeState::kRemoved}) {
    map.set_state(closure, state);
    EXPECT_EQ(route(map, "A", "F", filtered(filter)), "ABCDEF");
  }
}

TEST(Route, WeightsAreNotNegativeAndNotAllZero) {
  DrawnMap map("A---B");
  map.drive("AB");
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinite = std::numeric_limits<double>::infinity();
  for (const RouteWeights weights :
       {RouteWeights{0, 0, 0, 0}, RouteWeights{-1, 2, 0, 0}, RouteWeights{nan, 0, 0, 0},
        RouteWeights{1, infinite, 0, 0}, RouteWeights{1e300, 0, 0, 0}, RouteWeights{5e-324, 0, 0, 0}})
    EXPECT_EQ(route(map, "A", "B", {.weights = weights}), "INVALID_ARGUMENT");
  const std::vector<FrameId> a{map.id('A')}, b{map.id('B')};
  const Route found = find_route(map, a, b, {.weights = {2, 3, 0, 10}}).or_throw();
  EXPECT_NEAR(found.cost, 2 * 4 + 3 * 4 + 10 * 3e-4, 1e-6);
  EXPECT_EQ(found.distance_m, 4);
  EXPECT_EQ(route(map, "A", "B", {.weights = {2, 3, 0, 0}, .max_cost = 19}), "COST_LIMIT");
}

// The frames of the same route by a reference search that keeps everything: the first of the cheapest offers to a frame
// counts, and frames are settled by cost and then by id.
std::vector<FrameId> route_by_the_book(const storage::Graph& graph, FrameId from, FrameId to) {
  struct Node {
    double cost;
    FrameId parent;
    bool settled = false;
  };
  std::map<FrameId, Node> nodes{{from, {0, {}}}};
  for (;;) {
    const FrameId* best = nullptr;
    for (const auto& [frame, node] : nodes)
      if (!node.settled && (!best || node.cost < nodes.at(*best).cost)) best = &frame;
    if (!best) return {};
    const FrameId frame = *best;
    nodes.at(frame).settled = true;
    if (frame == to) break;
    for (const storage::Neighbour& step : storage::neighbours(graph, frame, *graph.hot(frame))) {
      const double cost = nodes.at(frame).cost + length_m(*storage::find_edge(graph, step.edge));
      const auto [other, fresh] = nodes.try_emplace(step.frame, Node{cost, frame});
      if (!fresh && !other->second.settled && cost < other->second.cost) other->second = {cost, frame};
    }
  }
  std::vector<FrameId> frames;
  for (FrameId frame = to; frame.valid(); frame = nodes.at(frame).parent) frames.insert(frames.begin(), frame);
  return frames;
}

// A grid, where most pairs have many routes of the same length.
TEST(Route, TheChoiceAmongEquallyCheapRoutesIsDeterministic) {
  std::mt19937 random(11);
  const std::string names = "ABCDEFGHIJKLMNOPQRSTUVWXYabcdefghijklmnopqrstuvwxy";
  for (int trial = 0; trial < 10; ++trial) {
    DrawnMap map("");
    for (int i = 0; i < 50; ++i) map.place(names[static_cast<std::size_t>(i)], {double(i % 7), 0, double(i / 7)});
    std::string order = names;
    std::shuffle(order.begin(), order.end(), random);
    for (const char c : order) map.drive(std::string{c});
    for (int i = 0; i < 50; ++i) {
      const char here = names[static_cast<std::size_t>(i)];
      if (i % 7 < 6 && i + 1 < 50) map.close(std::string{here, names[static_cast<std::size_t>(i + 1)]});
      if (i + 7 < 50) map.close(std::string{here, names[static_cast<std::size_t>(i + 7)]});
    }
    for (int pair = 0; pair < 200; ++pair) {
      const std::vector<FrameId> from{map.id(names[random() % 50])}, to{map.id(names[random() % 50])};
      std::vector<FrameId> frames;
      const Route route = find_route(map, from, to).or_throw();
      for (const RouteStep& step : steps_of(map, route)) frames.push_back(step.frame);
      EXPECT_EQ(frames, route_by_the_book(map, from[0], to[0]));
    }
  }
}

TEST(Route, HoldsAFewBytesForEachFrame) {
  constexpr std::uint32_t kFrames = 200'000;
  const storage::EndlessDrive drive(kFrames);
  std::size_t max_bytes = 0;
  const WorkLimit work{.proceed = [&](std::size_t bytes) {
    max_bytes = std::max(max_bytes, bytes);
    return Status();
  }};
  const std::vector<FrameId> from{{1, kFrames - 1}}, to{{1, 0}};
  const Route route = find_route(drive, from, to, {}, work).or_throw();
  EXPECT_EQ(route.steps(), kFrames);
  EXPECT_EQ(route.distance_m, kFrames - 1);
  EXPECT_GT(max_bytes, 2 * kFrames);
  EXPECT_LT(max_bytes, 8 * kFrames);
  std::uint32_t expected = kFrames;
  for (RouteWalk walk(drive, route); const auto step = walk.next();) ASSERT_EQ(step->frame.index, --expected);
  EXPECT_EQ(expected, 0u);
}

}  // namespace
}  // namespace relmap::route
