#include "server/map/support.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/map/closures.h"
#include "server/map/derived.h"
#include "server/map/edge_edit.h"
#include "server/map/sorted.h"
#include "storage/engine/memory_engine.h"
#include "storage/graph/observers.h"

namespace relmap::map {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

// A map made by hand: sessions of frames in a row, closures, and who sees what.
class SupportTest : public testing::Test {
 protected:
  SupportTest()
      : engine_(storage::make_memory_engine()),
        map_(storage::Map::open(engine_, engine_->acquire().or_throw(),
                                std::make_shared<storage::Budget>(std::size_t{64} << 20))
                 .or_throw()) {}

  // Frames first .. first + count - 1 of a session, taken in now; each with one landmark.
  void pass(SessionNumber number, std::uint32_t first, std::uint32_t count) {
    if (!map_->session(number)) {
      storage::Session session;
      session.number = number;
      session.first = first;
      map_->add_session(session);
    }
    for (std::uint32_t i = first; i < first + count; ++i) {
      const FrameId id{number, i};
      storage::FrameHot hot;
      hot.present = true;
      hot.journal_sequence = ++sequence_;
      hot.landmarks.resize(1);
      if (i > first || map_->hot({number, i - 1})) {
        storage::Edge edge;
        edge.id = {id, 0};
        edge.a = {number, i - 1};
        edge.b = id;
        edge.prior_active = true;
        hot.edges.push_back(edge);
        insert_sorted(map_->edit_hot(edge.a).incoming, edge.id);
      }
      map_->add_frame(id, std::move(hot), {}, {});
      storage::Session& session = map_->edit_session(number);
      session.last = i;
      ++session.frames;
    }
  }
  // Accepted, and an edge of the graph.
  ClosureId close(FrameId a, FrameId b) {
    storage::FrameHot& hot = map_->edit_hot(b);
    storage::Edge edge;
    edge.id = {b, hot.next_loop_ordinal++};
    edge.a = a;
    edge.b = b;
    edge.kind = storage::EdgeKind::kLoop;
    edge.verification = storage::Verification::kStereo;
    edge.prior_active = true;
    hot.edges.push_back(edge);
    insert_sorted(map_->edit_hot(a).incoming, edge.id);
    ++map_->state().closures_accepted;
    return edge.id;
  }
  void see(FrameId frame, LandmarkId landmark, ClosureId by = {}) {
    storage::Observation seen;
    seen.landmark = landmark;
    seen.origin = by;
    map_->edit_warm(frame).observations.push_back(seen);
    if (by.valid()) insert_sorted(map_->edit_hot(by.frame).edge(by)->bound_frames, frame);
    PathsTo paths(*map_, frame);
    add_support(*map_, paths);
  }
  void set(ClosureId closure, storage::EdgeState state) {
    apply_edge_edit(*map_, 1, {closure, state, "test"});
    EXPECT_THAT(derived_differences(*map_), IsEmpty());
  }
  std::vector<FrameId> observers(LandmarkId id) const { return map_->hot(id.base)->landmarks[id.slot].observers; }

  std::shared_ptr<storage::Engine> engine_;
  std::unique_ptr<storage::Map> map_;
  std::uint64_t sequence_ = 0;
};

TEST_F(SupportTest, UnreachedObserversReturnWithTheEdge) {
  for (const SessionNumber session : {1, 2, 3}) pass(session, 0, 21);
  const ClosureId second = close({1, 10}, {2, 10}), third = close({1, 10}, {3, 10});
  const LandmarkId landmark{{2, 12}, 0};
  see({2, 12}, landmark);
  see({2, 13}, landmark);
  see({3, 12}, landmark, third);  // over the first session
  ASSERT_THAT(derived_differences(*map_), IsEmpty());
  EXPECT_THAT(observers(landmark), ElementsAre(FrameId{2, 12}, FrameId{2, 13}, FrameId{3, 12}));

  set(second, storage::EdgeState::kRemoved);
  EXPECT_THAT(observers(landmark), ElementsAre(FrameId{2, 12}, FrameId{2, 13}));
  EXPECT_THAT(map_->hot({2, 12})->unreached, ElementsAre(storage::Unreached{0, {3, 12}}));
  set(second, storage::EdgeState::kAccepted);
  EXPECT_THAT(observers(landmark), ElementsAre(FrameId{2, 12}, FrameId{2, 13}, FrameId{3, 12}));
  EXPECT_THAT(map_->hot({2, 12})->unreached, IsEmpty());
  EXPECT_EQ(storage::find_edge(*map_, second)->support, 1u);

  set(third, storage::EdgeState::kRemoved);
  EXPECT_THAT(map_->hot({2, 12})->unreached, IsEmpty()) << "its observation went with the closure";
  set(third, storage::EdgeState::kAccepted);
  EXPECT_EQ(observers(landmark).size(), 3u);
}

TEST_F(SupportTest, ObserversOfAnUnneededLandmarkReturnWithIt) {
  for (const SessionNumber session : {1, 2, 3}) pass(session, 0, 21);
  const ClosureId second = close({1, 10}, {2, 10}), third = close({1, 10}, {3, 10});
  const LandmarkId landmark{{2, 12}, 0}, claimant{{2, 13}, 0};
  const ClosureId says_so = close({1, 11}, {2, 11});
  storage::Edge& edge = *map_->edit_hot(says_so.frame).edge(says_so);
  edge.carries = edge.prior_active = false;
  edge.verification = storage::Verification::kPnP;
  edge.bound_frames = {{2, 12}};
  map_->edit_hot(landmark.base).landmarks[0].claims = {{{}, says_so}};
  map_->edit_hot(claimant.base).landmarks[0].claims = {{landmark, second}};
  set(says_so, storage::EdgeState::kRemoved);
  see({2, 12}, landmark);
  see({2, 14}, claimant);
  see({3, 12}, landmark, third);
  const std::vector<FrameId> all{{2, 12}, {2, 14}, {3, 12}};
  ASSERT_THAT(derived_differences(*map_), IsEmpty());
  EXPECT_EQ(observers(landmark), all);

  set(says_so, storage::EdgeState::kAccepted);
  EXPECT_THAT(observers(landmark), IsEmpty());
  EXPECT_EQ(storage::find_edge(*map_, second)->support, 0u);
  EXPECT_EQ(map_->hot(landmark.base)->unreached.size(), 3u);
  set(says_so, storage::EdgeState::kRemoved);
  EXPECT_EQ(observers(landmark), all);
  EXPECT_THAT(map_->hot(landmark.base)->unreached, IsEmpty());

  set(second, storage::EdgeState::kRemoved);  // and with it the claim, and the way to (3, 12)
  EXPECT_THAT(map_->hot(landmark.base)->unreached, ElementsAre(storage::Unreached{0, {3, 12}}));
  set(says_so, storage::EdgeState::kAccepted);
  set(says_so, storage::EdgeState::kRemoved);
  EXPECT_THAT(map_->hot(landmark.base)->unreached, ElementsAre(storage::Unreached{0, {3, 12}}));
  set(says_so, storage::EdgeState::kAccepted);
  set(second, storage::EdgeState::kAccepted);
  EXPECT_EQ(map_->hot(landmark.base)->unreached.size(), 3u);
  see({3, 13}, landmark, third);  // it goes on being seen
  EXPECT_EQ(map_->hot(landmark.base)->unreached.size(), 4u);
  set(says_so, storage::EdgeState::kRemoved);
  EXPECT_EQ(observers(landmark).size(), 4u);
}

TEST_F(SupportTest, AnObserverThatJoinsTwoPassesMakesRoomForLaterOnes) {
  const LandmarkId landmark{{1, 10}, 0};
  pass(1, 0, 21);
  see({1, 10}, landmark);
  pass(2, 95, 46);
  close({1, 10}, {2, 100});
  close({1, 10}, {2, 135});
  see({2, 100}, landmark);
  const ClosureId between = close({1, 10}, {2, 120});
  see({2, 120}, landmark, between);
  see({2, 135}, landmark);
  for (const SessionNumber session : {3, 4, 5, 6}) {
    pass(session, 0, 21);
    close({1, 10}, {session, 10});
    see({session, 11}, landmark);
    see({session, 12}, landmark);
  }
  ASSERT_THAT(derived_differences(*map_), IsEmpty());
  const std::vector<FrameId> all{{1, 10}, {2, 100}, {2, 120}, {2, 135}, {3, 11}, {3, 12}, {4, 11}, {4, 12}, {5, 11}};
  EXPECT_EQ(observers(landmark), all);
  set(between, storage::EdgeState::kRemoved);
  EXPECT_THAT(observers(landmark), ElementsAre(FrameId{1, 10}, FrameId{2, 100}, FrameId{2, 135}, FrameId{3, 11},
                                               FrameId{3, 12}, FrameId{4, 11}));
  set(between, storage::EdgeState::kAccepted);
  EXPECT_EQ(observers(landmark), all);
}

TEST_F(SupportTest, APassRemovedFromAFixedLandmarkMakesRoomForLaterOnes) {
  const LandmarkId landmark{{1, 10}, 0};
  pass(1, 0, 21);
  see({1, 10}, landmark);
  std::vector<ClosureId> closures;
  for (SessionNumber session = 2; session <= 9; ++session) {
    pass(session, 0, 21);
    closures.push_back(close({1, 10}, {session, 10}));
    see({session, 11}, landmark);
  }
  EXPECT_THAT(observers(landmark),
              ElementsAre(FrameId{1, 10}, FrameId{2, 11}, FrameId{3, 11}, FrameId{4, 11}, FrameId{5, 11}));
  EXPECT_EQ(storage::find_edge(*map_, closures.back())->support, 1u) << "what is seen later counts";
  set(closures[1], storage::EdgeState::kRemoved);
  EXPECT_THAT(observers(landmark),
              ElementsAre(FrameId{1, 10}, FrameId{2, 11}, FrameId{4, 11}, FrameId{5, 11}, FrameId{6, 11}));
  EXPECT_THAT(map_->hot({1, 10})->unreached, ElementsAre(storage::Unreached{0, {3, 11}}));
  set(closures[7], storage::EdgeState::kRemoved);
  EXPECT_THAT(map_->hot({1, 10})->unreached,
              ElementsAre(storage::Unreached{0, {3, 11}}, storage::Unreached{0, {9, 11}}));
  set(closures[1], storage::EdgeState::kAccepted);
  set(closures[7], storage::EdgeState::kAccepted);
  EXPECT_THAT(map_->hot({1, 10})->unreached, IsEmpty());
}

}  // namespace
}  // namespace relmap::map
