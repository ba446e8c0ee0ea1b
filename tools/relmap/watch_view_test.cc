#include "tools/relmap/watch_view.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <ctime>

namespace relmap::cli {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

class WatchViewTest : public ::testing::Test {
 protected:
  void SetUp() override {
    setenv("TZ", "UTC0", 1);
    tzset();
    client::Session session;
    session.number = 3;
    session.name = "morning";
    view_.know({session});
  }
  template <typename What>
  std::vector<std::string> tell(What what, const std::string& author = "", const std::string& note = "") {
    client::WatchEvent event;
    event.what = std::move(what);
    event.time_us = std::int64_t{1'764'000'000} * 1'000'000;
    event.author = author;
    event.note = note;
    return view_.lines_of(event);
  }

  WatchView view_;
};

TEST_F(WatchViewTest, ALineSaysWhenWhatWhyAndWho) {
  client::Edge edge;
  edge.id = {{3, 340}, 1};
  edge.a = {3, 12};
  edge.b = {3, 340};
  edge.state = client::EdgeState::kRemoved;
  edge.reason = Reason::REMOVED_BY_OPERATOR;
  EXPECT_THAT(tell(client::EdgeChanged{edge}, "anna", "a mirror"),
              ElementsAre("2025-11-24 16:00:00  closure 3:340/1 of frames 3:12 and 3:340: removed, an operator took it "
                          "out, by anna: a mirror"));
  EXPECT_THAT(tell(client::SessionChanged{4, "", "cart", "noon", client::SessionState::kFrozen}, "anna"),
              ElementsAre("2025-11-24 16:00:00  session 4 'noon' of cart is frozen, by anna"));
  EXPECT_THAT(tell(client::SessionChanged{4, "", "cart", "noon", client::SessionState::kEnded}, "anna"),
              ElementsAre("2025-11-24 16:00:00  session 4 'noon' of cart is thawed, and ended as it was, by anna"));
  EXPECT_THAT(tell(client::SessionChanged{4, "", "cart", "noon", client::SessionState::kEnded}, "relmapd"),
              ElementsAre("2025-11-24 16:00:00  session 4 'noon' of cart has ended"));
  EXPECT_THAT(tell(client::FramesRemoved{4, 64}),
              ElementsAre("2025-11-24 16:00:00  session 4 'noon': frames from 64 on are deleted"));
  EXPECT_THAT(tell(client::SessionDeleted{4, ""}, "anna"),
              ElementsAre("2025-11-24 16:00:00  session 4 'noon' is deleted, by anna"));
  EXPECT_THAT(tell(client::EdgeRemoved{{{9, 1}, 2}}, "relmapd"),
              ElementsAre("2025-11-24 16:00:00  closure 9:1/2 went with its session"))
      << "nobody asked for it";
  EXPECT_THAT(tell(client::LabelsChanged{{3, 7}, {"dock", "gate"}}),
              ElementsAre("2025-11-24 16:00:00  frame 3:7 is labelled 'dock', 'gate'"));
  EXPECT_THAT(tell(client::LabelsChanged{{3, 7}, {}}),
              ElementsAre("2025-11-24 16:00:00  frame 3:7 has no label any more"));
  EXPECT_THAT(tell(client::SequencesSkipped{3, 5, 9, Reason::DROPPED_BY_ROBOT, false}),
              ElementsAre("2025-11-24 16:00:00  session 3 'morning': the robot gave up 5..9, DROPPED_BY_ROBOT"));
  EXPECT_THAT(
      tell(client::SequencesSkipped{3, 5, 5, Reason::TIME_AHEAD, true}),
      ElementsAre("2025-11-24 16:00:00  session 3 'morning': refused 5, TIME_AHEAD, its time is more than a day "
                  "ahead of the server's clock"));
  EXPECT_THAT(tell(client::EdgeRemoved{{{9, 1}, 2}}),
              ElementsAre("2025-11-24 16:00:00  closure 9:1/2 went with its session"));
  EXPECT_THAT(tell(client::Resynced{Reason::VIEW_EXPIRED, "events were lost", 3, 9}),
              ElementsAre("2025-11-24 16:00:00  VIEW_EXPIRED: events were lost"));
}

// Whatever is known of who did it: a session that is frozen neither begins nor ends.
TEST_F(WatchViewTest, AThawIsNoEnd) {
  const auto to = [&](client::SessionState state, const std::string& author) {
    return tell(client::SessionChanged{3, "", "cart", "morning", state}, author);
  };
  EXPECT_THAT(to(client::SessionState::kOpen, ""),
              ElementsAre("2025-11-24 16:00:00  session 3 'morning' of cart is open"));
  EXPECT_THAT(to(client::SessionState::kFrozen, ""),
              ElementsAre("2025-11-24 16:00:00  session 3 'morning' of cart is frozen"));
  EXPECT_THAT(to(client::SessionState::kOpen, ""),
              ElementsAre("2025-11-24 16:00:00  session 3 'morning' of cart is thawed, and open as it was"));
  EXPECT_THAT(to(client::SessionState::kEnded, ""),
              ElementsAre("2025-11-24 16:00:00  session 3 'morning' of cart has ended"));
}

TEST_F(WatchViewTest, NothingThatIsToldMovesTheCursorOrTurnsTextAround) {
  EXPECT_THAT(tell(client::LabelsChanged{{3, 7}, {"a\x1b[2Jb", "c\u202Ed"}}, "an\x07na", "one\ntwo\x9b"),
              ElementsAre("2025-11-24 16:00:00  frame 3:7 is labelled 'a\uFFFD[2Jb', 'c\uFFFDd', by an\uFFFDna: one "
                          "two\uFFFD"));
  tell(client::SessionChanged{5, "", "cart", "x\x1b]0;y\a", client::SessionState::kOpen});
  tell(client::FramesAdded{{{{5, 1}, 0, {}, {}}}});
  EXPECT_THAT(view_.flush(), ElementsAre("2025-11-24 16:00:00  session 5 'x\uFFFD]0;y\uFFFD': 1 frame added (1)"));
}

TEST_F(WatchViewTest, ARobotWithoutANameIsNamedByItsSession) {
  client::RobotStatus robot;
  robot.uuid = "0f1e2d3c-4b5a-4677-8899-aabbccddeeff";
  EXPECT_THAT(tell(client::RobotChanged{robot}),
              ElementsAre("2025-11-24 16:00:00  robot of session 0f1e2d3c is heard, and its session has not begun"));
  robot.refused[Reason::TIME_AHEAD] = 3;
  EXPECT_THAT(tell(client::RobotChanged{robot}),
              ElementsAre("2025-11-24 16:00:00  robot of session 0f1e2d3c: not begun, all that it sent was refused: "
                          "TIME_AHEAD, its time is more than a day ahead of the server's clock"));
}

TEST_F(WatchViewTest, FramesAreGatheredForEachSession) {
  EXPECT_THAT(tell(client::FramesAdded{{{{3, 7}, 0, {}, {}}, {{3, 8}, 0, {}, {}}}}), IsEmpty());
  EXPECT_THAT(tell(client::FramesAdded{{{{3, 10}, 0, {}, {}}}}), IsEmpty());
  EXPECT_THAT(tell(client::FramesMoved{{{1, 0, 9}, {3, 2, 3}, {3, 5, 5}}}), IsEmpty());
  EXPECT_THAT(view_.flush(),
              ElementsAre("2025-11-24 16:00:00  session 1: 10 frames adjusted",
                          "2025-11-24 16:00:00  session 3 'morning': 3 frames added (7..10), 3 frames adjusted"));
  EXPECT_THAT(view_.flush(), IsEmpty());
}

TEST_F(WatchViewTest, ThatAllIsWellIsToldOnlyAfterTrouble) {
  EXPECT_THAT(tell(client::StorageChanged{}), IsEmpty());
  EXPECT_THAT(tell(client::StorageChanged{{Reason::DISK_FULL, "no room"}}),
              ElementsAre("2025-11-24 16:00:00  nothing is taken in: DISK_FULL: no room"));
  EXPECT_THAT(tell(client::StorageChanged{{Reason::DISK_FULL, "no room"}}), IsEmpty()) << "after a reconnection";
  EXPECT_THAT(tell(client::StorageChanged{}), ElementsAre("2025-11-24 16:00:00  keyframes are taken in again"));
  client::RobotStatus robot;
  robot.robot = "cart";
  robot.session = 3;
  EXPECT_THAT(tell(client::RobotChanged{robot}),
              ElementsAre("2025-11-24 16:00:00  robot cart sends keyframes for session 3 'morning'"));
  robot.blocked = Reason::DISK_FULL;
  EXPECT_THAT(
      tell(client::RobotChanged{robot}),
      ElementsAre("2025-11-24 16:00:00  robot cart: DISK_FULL, its keyframes cannot be written to the journal"));
  EXPECT_THAT(tell(client::CaughtUp{}), IsEmpty());
}

}  // namespace
}  // namespace relmap::cli
