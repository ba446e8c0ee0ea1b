#include "server/route/alternatives.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <map>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "server/route/beside.h"
#include "server/route/testing/drawn_map.h"

namespace relmap::route {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

class Asked {
 public:
  Asked(const DrawnMap& map, RouteOptions options = {}) : map_(map), options_(std::move(options)) {}

  Route cheapest(std::vector<FrameId> from, std::vector<FrameId> to) const {
    return find_route(map_, from, to, options_).or_throw();
  }
  std::vector<Alternative> alternatives(std::vector<FrameId> from, std::vector<FrameId> to, std::size_t count,
                                        const WorkLimit& work = {}) const {
    const Route first = cheapest(from, to);
    return find_alternatives(map_, first, {from, to, options_.weights, options_.max_cost, count}, search(), work);
  }
  std::vector<std::string> names(char from, char to, std::size_t count) const {
    std::vector<std::string> all{name(cheapest({map_.id(from)}, {map_.id(to)}))};
    for (const Alternative& other : alternatives({map_.id(from)}, {map_.id(to)}, count))
      all.push_back(name(other.route));
    return all;
  }
  PenalisedSearch search() const {
    return [this](std::span<const FrameId> from, std::span<const FrameId> to, const Penalty& penalty,
                  const WorkLimit& work) {
      RouteOptions options = options_;
      options.max_cost = std::numeric_limits<double>::infinity();
      options.penalty = penalty;
      return find_route(map_, from, to, options, work);
    };
  }
  std::vector<FrameId> frames(const Route& route) const {
    std::vector<FrameId> frames;
    for (RouteWalk walk(map_, route); const auto step = walk.next();) frames.push_back(step->frame);
    return frames;
  }
  std::string name(const Route& route) const {
    std::string text;
    for (const FrameId frame : frames(route)) text += map_.name(frame);
    return text;
  }

 private:
  const DrawnMap& map_;
  const RouteOptions options_;
};

// Three ways lead round two blocks; each is an alternative to the others.
TEST(Alternatives, AreTheWaysAroundTheBlocks) {
  DrawnMap map(R"(
    A-B-C-D-E-F-G
    |           |
    H-I-J-K-L-M-N
    |           |
    O-P-Q-R-S-T-U
  )");
  map.drive("HIJKLMNGFEDCBA");
  map.drive("OPQRSTU");
  map.close("AH");
  map.close("HO");
  map.close("NU");
  const Asked asked(map);
  const auto found = asked.names('H', 'N', 5);
  ASSERT_EQ(found.size(), 3u);
  EXPECT_EQ(found[0], "HIJKLMN");
  EXPECT_THAT((std::set<std::string>{found[1], found[2]}), ElementsAre("HABCDEFGN", "HOPQRSTUN"));
  EXPECT_EQ(asked.names('H', 'N', 1).size(), 2u);
  EXPECT_EQ(asked.names('H', 'N', 0).size(), 1u);
  EXPECT_EQ(asked.names('H', 'N', 5), found) << "deterministic";
  RouteOptions limited;
  limited.max_cost = 15;
  EXPECT_THAT(Asked(map, limited).names('H', 'N', 5), ElementsAre("HIJKLMN")) << "the others have 16 m";
  limited.max_cost = 17;
  EXPECT_EQ(Asked(map, limited).names('H', 'N', 5).size(), 3u) << "their cost is without the penalty";
}

TEST(Alternatives, AreAtMostOneAndAHalfTimesAsDear) {
  DrawnMap map(R"(
    A-B-C-D-E
    |       |
    F       J
    |       |
    K       O
    |       |
    P-Q-R-S-T
  )");
  map.drive("ABCDEJOTSRQPKF");
  map.close("AF");
  EXPECT_THAT(Asked(map).names('F', 'J', 3), ElementsAre("FABCDEJ", "FKPQRSTOJ")) << "12 and 16 m";
  EXPECT_THAT(Asked(map).names('A', 'E', 3), ElementsAre("ABCDE")) << "20 m are too far for 8";
}

// Where a street was driven twice, the other pass is no other way.
TEST(Alternatives, AreNotTheSameStreetOnAnotherPass) {
  DrawnMap map(R"(
    A-B-C-D-E-F-G-H-I-J-K-L-M-N-O-P-Q-R-S-T-U-V-W-X
    a-b-c-d-e-f-g-h-i-j-k-l-m-n-o-p-q-r-s-t-u-v-w-x
  )",
               0.5);
  map.drive("ABCDEFGHIJKLMNOPQRSTUVWX");
  map.drive("abcdefghijklmnopqrstuvwx");
  map.close("Aa");
  map.close("Xx");
  EXPECT_EQ(Asked(map).names('A', 'X', 3).size(), 2u) << "so far the map does not know that they are beside each other";
  for (char name = 'B'; name < 'X'; ++name) {
    // Closures that only bind landmarks, as most are that lie so densely.
    const EdgeId closure = map.close(std::string{name, static_cast<char>(name - 'A' + 'a')});
    map.editable(closure.frame).edge(closure)->carries = false;
    map.editable(closure.frame).edge(closure)->verification = storage::Verification::kStereo;
  }
  EXPECT_EQ(Asked(map).names('A', 'X', 3).size(), 1u);
}

// The way around the block is an alternative. That it also leaves the main street further on, by a few dearer metres,
// comes of the penalty only, and is put back.
TEST(Alternatives, KeepNoDetoursThatThePenaltyBroughtAbout) {
  DrawnMap map("");
  const std::string main = "ABCDEFGHIJKLM";
  for (std::size_t i = 0; i < main.size(); ++i) map.place(main[i], {100.0 * static_cast<double>(i), 0, 0});
  map.drive(main);
  map.place('r', {0, 0, 80});
  map.place('s', {600, 0, 80});
  map.drive("rs");
  map.close("Ar");
  map.close("sG");  // around the block from A to G: 760 m instead of 600
  map.place('x', {950, 0, 30});
  map.drive("x");
  map.close("xJ");
  map.close("xK");  // 117 m instead of 100
  const Asked asked(map);
  const auto found = asked.names('A', 'M', 3);
  ASSERT_GE(found.size(), 2u);
  EXPECT_EQ(found[0], main);
  for (std::size_t i = 1; i < found.size(); ++i) EXPECT_EQ(found[i].find('x'), std::string::npos) << found[i];
  EXPECT_EQ(found[1], "ArsGHIJKLM");
}

TEST(Alternatives, KeepToTheFilterAndToDirections) {
  DrawnMap map(R"(
    A-B-C-D-E-F-G
    |           |
    H-I-J-K-L-M-N
  )");
  map.drive("HIJKLMN");
  map.drive("GFEDCBA", {.oneway = true});  // from G to A only
  map.close("AH");
  map.close("GN");
  EXPECT_THAT(Asked(map).names('H', 'N', 2), ElementsAre("HIJKLMN"));
  EXPECT_THAT(Asked(map).names('N', 'H', 2), ElementsAre("NMLKJIH", "NGFEDCBAH"));
  RouteOptions around_c;
  around_c.filter.avoided.insert(map.id('C'));
  EXPECT_THAT(Asked(map, around_c).names('N', 'H', 2), ElementsAre("NMLKJIH"));
}

TEST(Alternatives, MayUseOtherEndsIfThereAreSeveral) {
  DrawnMap map(R"(
    A-B-C-D-E-F-G-H-I
  )");
  map.drive("ABCDEFGHI");
  const Asked asked(map);
  const auto found = asked.alternatives({map.id('E')}, {map.id('A'), map.id('I')}, 3);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NE(asked.name(found[0].route), asked.name(asked.cheapest({map.id('E')}, {map.id('A'), map.id('I')})));
  EXPECT_EQ(found[0].shared, 0);
  EXPECT_THAT(asked.alternatives({map.id('E')}, {map.id('E')}, 3), IsEmpty()) << "there is no other way to stay";
}

TEST(Alternatives, AreFewerWhereTheWorkEnds) {
  DrawnMap map(R"(
    A-B-C-D-E-F-G
    |           |
    H-I-J-K-L-M-N
  )");
  map.drive("HIJKLMNGFEDCBA");
  map.close("AH");
  const Asked asked(map);
  ASSERT_EQ(asked.alternatives({map.id('H')}, {map.id('N')}, 2).size(), 1u);
  EXPECT_THAT(asked.alternatives({map.id('H')}, {map.id('N')}, 2, {.max_frames = 12, .proceed = {}}), IsEmpty());
  const WorkLimit late{.max_frames = 1000, .proceed = [](std::size_t) { return Status(Reason::DEADLINE, "late"); }};
  EXPECT_THAT(asked.alternatives({map.id('H')}, {map.id('N')}, 2, late), IsEmpty());
}

// A small map with edges at random, and everything about it by brute force.
struct RandomMap {
  explicit RandomMap(std::uint64_t seed) : map("") {
    std::mt19937_64 random(seed);
    const auto number = [&](double below) { return below * static_cast<double>(random() % 1'000'000) * 1e-6; };
    for (const char name : kNames) map.place(name, {number(20), 0, number(20)});
    map.drive(kNames.substr(0, 6), {.oneway = seed % 4 == 0});
    map.drive(kNames.substr(6));
    for (int i = 0; i < 9; ++i) {
      const char a = kNames[random() % kNames.size()], b = kNames[random() % kNames.size()];
      if (a != b) map.close(std::string{a, b}, number(30));
    }
  }

  // Visits all ways without repeated frames of which no part costs more than kMaxStretch times the cheapest way between
  // its ends.
  struct Ways {
    const DrawnMap& map;
    const RouteOptions& options;
    FrameId to;
    std::function<void(const std::vector<FrameId>&)> visit;
    std::vector<FrameId> way = {};
    std::vector<double> costs = {0};  // so far
    std::map<std::pair<FrameId, FrameId>, double> cheapest = {};

    void go_on() {
      if (way.back() == to) return visit(way);
      Passage passage(map, options.filter);
      const FrameId here = way.back();
      const auto hot = map.hot(here);
      for (const storage::Neighbour& step : storage::neighbours(map, here, *hot)) {
        if (std::find(way.begin(), way.end(), step.frame) != way.end()) continue;
        const EdgeRef edge(map, here, hot, step);
        if (!passage.open(*edge, step.forward)) continue;
        const double cost = costs.back() + options.weights(*edge);
        bool is_detour = false;
        for (std::size_t i = 0; i < way.size(); ++i)
          is_detour = is_detour || cost - costs[i] > kMaxStretch * cost_between(way[i], step.frame);
        if (is_detour) continue;
        way.push_back(step.frame);
        costs.push_back(cost);
        go_on();
        way.pop_back();
        costs.pop_back();
      }
    }
    double cost_between(FrameId a, FrameId b) {
      const auto [known, is_new] = cheapest.try_emplace({a, b}, 0);
      if (is_new) known->second = find_route(map, {&a, 1}, {&b, 1}, options)->cost;
      return known->second;
    }
  };

  static inline const std::string kNames = "ABCDEFGHIJKLMN";
  DrawnMap map;
};

double metres_between(const DrawnMap& map, FrameId a, FrameId b) {
  double metres = std::numeric_limits<double>::infinity();
  for (const storage::Neighbour& step : storage::neighbours(map, a, *map.hot(a)))
    if (step.frame == b) metres = std::min(metres, length_m(*storage::find_edge(map, step.edge)));
  return metres;
}

// The share of a way that runs between frames that are among these or within `width` of them.
double share_beside(const DrawnMap& map, const std::vector<FrameId>& way, const std::set<FrameId>& before,
                    double width) {
  const auto is_beside = [&](FrameId frame) {
    for (const FrameId other : before) {
      if (other == frame) return true;
      const auto near = frames_beside(map, {&other, 1}, width, {});
      if (near->contains(frame)) return true;
    }
    return false;
  };
  double all = 0, beside = 0;
  for (std::size_t i = 0; i + 1 < way.size(); ++i) {
    const double metres = metres_between(map, way[i], way[i + 1]);
    all += metres;
    if (is_beside(way[i]) && is_beside(way[i + 1])) beside += metres;
  }
  return all > 0 ? beside / all : 1;
}

TEST(Alternatives, KeepTheirBoundsOnRandomMaps) {
  int possible = 0, found = 0;
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    const RandomMap random(seed);
    const DrawnMap& map = random.map;
    RouteOptions options;
    if (seed % 3 == 1) options.weights = kByTime;
    const Asked asked(map, options);
    const FrameId from = map.id('A'), to = map.id(RandomMap::kNames[5 + seed % 9]);
    const auto cheapest = find_route(map, {&from, 1}, {&to, 1}, options);
    if (!cheapest.ok()) continue;
    const auto others = asked.alternatives({from}, {to}, 3);
    const double width = std::min(kBesideMetres, kBesideShare * cheapest->distance_m);
    std::vector<FrameId> way = asked.frames(*cheapest);
    std::set<FrameId> before(way.begin(), way.end());
    double cost_before = cheapest->cost;
    for (const Alternative& other : others) {
      way = asked.frames(other.route);
      EXPECT_EQ(way.front(), from);
      EXPECT_EQ(way.back(), to);
      EXPECT_EQ(std::set<FrameId>(way.begin(), way.end()).size(), way.size()) << "no frame twice";
      std::vector<double> costs{0};  // so far
      Passage passage(map, options.filter);
      for (RouteWalk walk(map, other.route); const auto step = walk.next();)
        if (step->edge.valid()) {
          const storage::Edge edge = *storage::find_edge(map, step->edge);
          EXPECT_TRUE(passage.open(edge, edge.a == step->frame));
          costs.push_back(costs.back() + options.weights(edge));
        }
      EXPECT_NEAR(other.route.cost, costs.back(), 1e-9);
      EXPECT_GE(other.route.cost, cost_before);
      EXPECT_LE(other.route.cost, kMaxStretch * cheapest->cost);
      EXPECT_LE(other.shared, kMaxShared);
      EXPECT_NEAR(other.shared, share_beside(map, way, before, width), 1e-9);
      for (std::size_t i = 0; i < way.size(); ++i)
        for (std::size_t j = i + 1; j < way.size(); ++j)
          EXPECT_LE(costs[j] - costs[i],
                    kMaxStretch * find_route(map, {&way[i], 1}, {&way[j], 1}, options)->cost + 1e-9)
              << "no part of it is a detour";
      before.insert(way.begin(), way.end());
      cost_before = other.route.cost;
    }
    // Is there an alternative at all?
    way = asked.frames(*cheapest);
    const std::set<FrameId> on_cheapest(way.begin(), way.end());
    bool any = false;
    RandomMap::Ways ways{map, options, to, [&](const std::vector<FrameId>& whole) {
                           any = any || share_beside(map, whole, on_cheapest, width) <= kMaxShared;
                         }};
    ways.way = {from};
    ways.go_on();
    possible += any;
    found += !others.empty();
    EXPECT_TRUE(any || others.empty());
  }
  EXPECT_GT(possible, 50);
  EXPECT_GE(found, 0.9 * possible) << "the method misses few";
}

}  // namespace
}  // namespace relmap::route
