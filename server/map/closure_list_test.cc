#include "server/map/closure_list.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <memory>
#include <set>
#include <utility>
#include <vector>

#include "storage/engine/memory_engine.h"
#include "storage/testing/random_frames.h"

namespace relmap::map {
namespace {

using storage::Edge;
using storage::EdgeKind;
using storage::EdgeState;

const Proceed kGoOn = [] { return Status(); };
constexpr std::int64_t kBegin = 1'700'000'000'000'000;

// A map of some sessions with closures at random, of which a part is committed.
class ClosureList : public ::testing::Test {
 protected:
  static constexpr SessionNumber kSessions = 5;
  static constexpr std::uint32_t kFrames = 150;

  ClosureList() {
    auto engine = storage::make_memory_engine();
    const std::uint64_t epoch = engine->acquire().or_throw();
    map_ = storage::Map::open(engine, epoch, std::make_shared<storage::Budget>(std::size_t{64} << 20)).or_throw();
    for (SessionNumber number = 1; number <= kSessions; ++number) {
      storage::Session session;
      session.number = number;
      session.header.name = session.display_name = "drive " + std::to_string(number);
      map_->add_session(session);
      for (std::uint32_t i = 0; i < kFrames; ++i) add({number, i});
      if (number == 3)
        if (Status status = map_->commit(); !status.ok()) throw StatusError(status);
    }
    for (int i = 0; i < 60; ++i) change();  // on top of the commit
  }

  void add(FrameId id) {
    storage::FrameHot hot;
    hot.present = true;
    hot.time_us = kBegin + 1000 * static_cast<std::int64_t>(random_.below(40'000));
    if (id.index > 0) {
      Edge step;
      step.id = {id, 0};
      step.a = {id.session, id.index - 1};
      step.b = id;
      step.kind = random_.below(10) == 0 ? EdgeKind::kPrior : EdgeKind::kOdometry;
      step.T_ab.t = {0, 0, 1};
      step.covariance = 1e-4 * Matrix6::Identity();
      hot.edges.push_back(step);
    }
    for (std::uint32_t n = random_.below(3), ordinal = 1; n > 0; --n, ++ordinal) {
      const FrameId a{1 + random_.below(id.session), random_.below(kFrames)};
      if (id.index > 0 && a < id) hot.edges.push_back(closure(a, id, ordinal));
    }
    hot.next_loop_ordinal = 3;
    const std::vector<Edge> edges = hot.edges;
    map_->add_frame(id, std::move(hot), {}, {});
    for (const Edge& edge : edges) {
      auto& incoming = map_->edit_hot(edge.a).incoming;
      incoming.insert(std::upper_bound(incoming.begin(), incoming.end(), edge.id), edge.id);
    }
    storage::Session& session = map_->edit_session(id.session);
    session.last = id.index;
    ++session.frames;
  }
  Edge closure(FrameId a, FrameId b, std::uint32_t ordinal) {
    Edge edge;
    edge.id = {b, ordinal};
    edge.a = a;
    edge.b = b;
    edge.kind = random_.below(20) == 0 ? EdgeKind::kPrior : EdgeKind::kLoop;
    edge.state = some_state();
    edge.reason = Reason::CONSISTENT;
    edge.verification = storage::Verification::kStereo;
    edge.T_ab.t = {0.1 * random_.below(20), 0, 0};
    edge.prior_T_ab = edge.T_ab;
    edge.covariance = edge.prior_covariance = 1e-3 * Matrix6::Identity();
    edge.inliers =
        static_cast<std::uint16_t>(10 * random_.below(12));  // few values, so that many are equally suspicious
    edge.spread = 0.1F * static_cast<float>(random_.below(4));
    edge.probability = 0.3F * static_cast<float>(random_.below(4));
    edge.tests.opposing = static_cast<std::uint16_t>(random_.below(3));
    return edge;
  }
  EdgeState some_state() { return static_cast<EdgeState>(1 + random_.below(4)); }
  void change() {
    storage::FrameHot& frame = map_->edit_hot({1 + random_.below(kSessions), random_.below(kFrames)});
    for (Edge& edge : frame.edges)
      if (edge.id.ordinal > 0) {
        edge.state = some_state();
        edge.inliers = static_cast<std::uint16_t>(random_.below(100));
      }
    map_->publish();
  }

  // All edges with the times of their newer ends, by id.
  std::vector<std::pair<Edge, std::int64_t>> all() const {
    std::vector<std::pair<Edge, std::int64_t>> edges;
    for (SessionNumber number = 1; number <= kSessions; ++number)
      for (std::uint32_t i = 0; i < kFrames; ++i) {
        const auto hot = map_->view()->hot({number, i});
        for (const Edge& edge : hot->edges) edges.emplace_back(edge, hot->time_us);
      }
    return edges;
  }
  EdgeChoice some_choice() {
    EdgeChoice choice;
    const auto perhaps = [this] { return random_.below(3) == 0; };
    if (perhaps()) choice.filter.states = {some_state(), some_state()};
    if (perhaps()) choice.filter.kinds = {static_cast<EdgeKind>(1 + random_.below(3)), EdgeKind::kLoop};
    if (perhaps()) choice.filter.session = 1 + random_.below(kSessions);
    if (choice.filter.session && perhaps()) choice.filter.other_session = 1 + random_.below(kSessions);
    if (random_.below(8) == 0) choice.filter.frame = FrameId{1 + random_.below(kSessions), random_.below(kFrames)};
    if (perhaps()) choice.from_us = kBegin + 1000 * static_cast<std::int64_t>(random_.below(30'000));
    if (perhaps()) choice.until_us = kBegin + 1000 * static_cast<std::int64_t>(10'000 + random_.below(30'000));
    if (perhaps()) choice.min_suspicion = 0.1 * (1 + random_.below(9));
    if (perhaps()) {
      choice.region.emplace();
      for (int i = 0; i < 100; ++i) choice.region->insert({1 + random_.below(kSessions), random_.below(kFrames)});
    }
    return choice;
  }
  // By what the request says of each filter, one after the other.
  static bool is_chosen(const EdgeChoice& c, const Edge& edge, std::int64_t time_us) {
    if (!c.filter.states.empty() && !c.filter.states.contains(edge.state)) return false;
    if (!c.filter.kinds.empty() && !c.filter.kinds.contains(edge.kind)) return false;
    const std::multiset<SessionNumber> sessions{edge.a.session, edge.b.session};
    if (c.filter.session && !c.filter.other_session && !sessions.contains(*c.filter.session)) return false;
    if (c.filter.other_session && sessions != std::multiset<SessionNumber>{*c.filter.session, *c.filter.other_session})
      return false;
    if (c.filter.frame && edge.a != *c.filter.frame && edge.b != *c.filter.frame) return false;
    if (c.from_us != 0 && time_us < c.from_us) return false;
    if (c.until_us != 0 && time_us >= c.until_us) return false;
    if (c.min_suspicion > 0 && (edge.kind != EdgeKind::kLoop || listed_suspicion(edge) < c.min_suspicion)) return false;
    return !c.region || c.region->contains(edge.a) || c.region->contains(edge.b);
  }

  storage::RandomFrames random_{7};
  std::unique_ptr<storage::Map> map_;
};

TEST_F(ClosureList, EdgesByIdAreThoseThatTheFiltersTell) {
  const auto view = map_->view();
  const auto edges = all();
  std::size_t chosen = 0;
  for (int round = 0; round < 200; ++round) {
    const EdgeChoice choice = some_choice();
    std::vector<EdgeId> expected, found;
    for (const auto& [edge, time_us] : edges)
      if (is_chosen(choice, edge, time_us)) expected.push_back(edge.id);
    const std::size_t page = 1 + random_.below(100);
    for (EdgeId after;;) {  // page by page
      std::size_t n = 0;
      const Status status = visit_edges(*view, choice, after, kGoOn, [&](const Edge& edge, std::int64_t time_us) {
        if (n == page) return false;
        EXPECT_EQ(time_us, view->hot(edge.b)->time_us);
        found.push_back(after = edge.id);
        ++n;
        return true;
      });
      ASSERT_TRUE(status.ok()) << status.to_string();
      if (n < page) break;
    }
    ASSERT_EQ(found, expected) << round;
    chosen += found.size();
  }
  EXPECT_GT(chosen, 1000u);
}

TEST_F(ClosureList, EachOrderIsTotalAndItsPagesNeitherRepeatNorLose) {
  const auto view = map_->view();
  const auto edges = all();
  std::size_t equals = 0;
  for (int round = 0; round < 100; ++round) {
    const EdgeChoice choice = round < 2 ? EdgeChoice() : some_choice();
    const auto order = round % 2 ? ClosureOrder::kSuspicion : ClosureOrder::kTime;
    std::vector<std::pair<Edge, std::int64_t>> expected;
    for (const auto& [edge, time_us] : edges)
      if (edge.kind == EdgeKind::kLoop && is_chosen(choice, edge, time_us)) expected.emplace_back(edge, time_us);
    std::stable_sort(expected.begin(), expected.end(), [&](const auto& x, const auto& y) {
      return order == ClosureOrder::kSuspicion ? listed_suspicion(x.first) > listed_suspicion(y.first)
                                               : std::pair(x.second, x.first.id) > std::pair(y.second, y.first.id);
    });
    std::vector<ListedClosure> found;
    for (std::optional<ListedClosure> after;;) {
      const std::size_t page = 1 + random_.below(100);
      const auto more = first_closures(*view, choice, order, after, page, kGoOn).or_throw();
      found.insert(found.end(), more.begin(), more.end());
      if (more.size() < page) break;
      after = more.back();
    }
    ASSERT_EQ(found.size(), expected.size());
    for (std::size_t i = 0; i < found.size(); ++i) {
      ASSERT_EQ(found[i].id, expected[i].first.id) << i;
      EXPECT_EQ(found[i].time_us, expected[i].second);
      if (order == ClosureOrder::kSuspicion) {
        EXPECT_EQ(found[i].suspicion, listed_suspicion(expected[i].first));
        equals += i > 0 && found[i].suspicion == found[i - 1].suspicion;
      }
    }
  }
  EXPECT_GT(equals, 0u);
}

TEST_F(ClosureList, CellsCountTheClosuresOfEachTwoSessions) {
  const auto view = map_->view();
  const auto edges = all();
  for (int round = 0; round < 20; ++round) {
    std::set<SessionNumber> chosen;
    if (round > 0)
      for (std::uint32_t n = 1 + random_.below(3); n > 0; --n) chosen.insert(1 + random_.below(kSessions));
    std::map<std::pair<SessionNumber, SessionNumber>, ClosureCell> expected;
    for (const auto& [edge, time_us] : edges) {
      const auto [a, b] = std::minmax({edge.a.session, edge.b.session});
      if (edge.kind != EdgeKind::kLoop || (!chosen.empty() && !chosen.contains(a) && !chosen.contains(b))) continue;
      ClosureCell& cell = expected[{a, b}];
      (edge.state == EdgeState::kCandidate     ? cell.candidate
       : edge.state == EdgeState::kAccepted    ? cell.accepted
       : edge.state == EdgeState::kQuarantined ? cell.quarantined
                                               : cell.removed)++;
      if (edge.state == EdgeState::kAccepted)
        if (const double suspicion = listed_suspicion(edge);
            !cell.most_suspicious.valid() || suspicion > cell.suspicion) {
          cell.most_suspicious = edge.id;
          cell.suspicion = suspicion;
        }
    }
    const std::vector<SessionNumber> sessions(chosen.begin(), chosen.end());
    std::vector<ClosureCell> found;
    for (std::pair<SessionNumber, SessionNumber> after{0, 0};;) {
      const std::size_t page = 1 + random_.below(6);
      const auto more = closure_cells(*view, sessions, after, page, kGoOn).or_throw();
      found.insert(found.end(), more.begin(), more.end());
      if (more.size() < page) break;
      after = {more.back().session_a, more.back().session_b};
    }
    ASSERT_EQ(found.size(), expected.size());
    auto it = expected.begin();
    for (const ClosureCell& cell : found) {
      const auto& [key, other] = *it++;
      EXPECT_EQ(key, std::pair(cell.session_a, cell.session_b));
      EXPECT_EQ(cell.candidate, other.candidate);
      EXPECT_EQ(cell.accepted, other.accepted);
      EXPECT_EQ(cell.quarantined, other.quarantined);
      EXPECT_EQ(cell.removed, other.removed);
      EXPECT_EQ(cell.most_suspicious, other.most_suspicious);
      EXPECT_EQ(cell.suspicion, other.suspicion);
    }
  }
}

// What an edit changes is in the lists of the view that shows it, committed or not, and not in those of views before
// it.
TEST_F(ClosureList, EachViewHasItsOwnState) {
  EdgeChoice removed;
  removed.filter.states = {EdgeState::kRemoved};
  const auto count = [&](const storage::MapView& view) {
    return first_closures(view, removed, ClosureOrder::kSuspicion, {}, 100'000, kGoOn)->size();
  };
  const auto before = map_->view();
  const std::size_t then = count(*before);
  EdgeId id;
  for (const auto& [edge, time_us] : all())
    if (edge.kind == EdgeKind::kLoop && edge.state == EdgeState::kAccepted) id = edge.id;
  map_->edit_hot(id.frame).edge(id)->state = EdgeState::kRemoved;
  const auto after = map_->publish();
  EXPECT_EQ(count(*after), then + 1);
  EXPECT_EQ(count(*before), then);
  ASSERT_TRUE(map_->commit().ok());
  EXPECT_EQ(count(*map_->view()), then + 1);
}

TEST_F(ClosureList, EndsWhenItIsTold) {
  const Proceed late = [] { return Status(Reason::DEADLINE, "late"); };
  const auto view = map_->view();
  EXPECT_EQ(first_closures(*view, {}, ClosureOrder::kTime, {}, 5, late).reason(), Reason::DEADLINE);
  EXPECT_EQ(closure_cells(*view, {}, {0, 0}, 5, late).reason(), Reason::DEADLINE);
  const auto any = [](const Edge&, std::int64_t) { return true; };
  EXPECT_EQ(visit_edges(*view, {}, {}, late, any).reason(), Reason::DEADLINE);
  EdgeChoice choice;
  choice.region.emplace();
  choice.region->insert({1, 1});
  EXPECT_EQ(visit_edges(*view, choice, {}, late, any).reason(), Reason::DEADLINE);
}

}  // namespace
}  // namespace relmap::map
