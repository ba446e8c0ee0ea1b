#include "server/rpc/map_watch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <thread>
#include <vector>

#include "server/rpc/event_messages.h"
#include "server/rpc/testing/scripted_feed.h"
#include "server/rpc/watch_token.h"

namespace relmap::rpc {
namespace {

using ::testing::ElementsAre;
using Kind = v1::MapEvent::EventCase;

const MapIdentity kMap{*Uuid::parse("00112233-4455-6677-8899-aabbccddeeff"), 5};

storage::FrameAddedEvent added(SessionNumber session, std::uint32_t index) {
  storage::FrameAddedEvent event{{session, index}, 10 * index, {}, MotionSource::kVision};
  if (index > 0) event.T_previous_frame.emplace();
  return event;
}

storage::ClosureEvent closure(EdgeId id, FrameId a) {
  storage::ClosureEvent event;
  event.id = id;
  event.a = a;
  return event;
}

class MapWatchTest : public ::testing::Test {
 protected:
  struct Watcher {
    std::shared_ptr<MapWatch> watch;
    std::string token = {};  // of the last message
    bool begun = false;      // a message has come
  };
  Result<Watcher> begin(const v1::WatchMapRequest& request, const MapIdentity& map = kMap) {
    auto watch = MapWatch::begin(request, map, log_.reader(), feed_);
    if (!watch.ok()) return watch.status();
    return Watcher{std::move(*watch)};
  }
  Watcher from_oldest(v1::WatchMapRequest request = {}) {
    request.set_from(v1::WATCH_FROM_OLDEST);
    return begin(request).or_throw();
  }
  Watcher resumed(const std::string& token) {
    v1::WatchMapRequest request;
    request.set_resume_token(token);
    return begin(request).or_throw();
  }
  // The next message; nullopt if there is none for now.
  std::optional<v1::MapEvent> next(Watcher& watcher) {
    for (;;) {
      const auto next = watcher.watch->next([] {}, now_);
      if (!next.ok()) throw StatusError(next.status());
      EXPECT_TRUE(next->has_value()) << "a watch has no end";
      if (const auto* message = std::get_if<v1::MapEvent>(&**next)) {
        watcher.token = message->resume_token();
        watcher.begun = true;
        EXPECT_LT(message->ByteSizeLong(), 256u << 10);
        return *message;
      }
      const auto until = std::get<Waiting>(**next).until;
      if (until <= now_) continue;
      if (watcher.begun) return {};
      std::this_thread::sleep_for(std::chrono::milliseconds(1));  // the feed has not looked yet
    }
  }
  // All messages until the watcher has caught up, that included; storage, which comes first, is left out.
  std::vector<v1::MapEvent> all(Watcher& watcher) {
    std::vector<v1::MapEvent> messages;
    for (;;) {
      auto message = next(watcher);
      if (!message) return messages;
      if (!message->has_storage_changed()) messages.push_back(*message);
      if (message->has_caught_up()) return messages;
    }
  }
  static std::vector<Kind> kinds(const std::vector<v1::MapEvent>& messages) {
    std::vector<Kind> kinds;
    for (const v1::MapEvent& message : messages) kinds.push_back(message.event_case());
    return kinds;
  }
  void commit(std::uint64_t sequence) { script_.commit(sequence); }

  ScriptedFeed script_;
  WatchFeed feed_{script_.sources()};
  ScriptedLog log_;
  MapWatch::Clock::time_point now_ = MapWatch::Clock::now();
};

TEST_F(MapWatchTest, WhatNoCallerDidIsOfRelmapdAndWhatSaysNotWhenOfItsCommit) {
  storage::Event event{{7, 0}, {5, "anna"}, "a mirror", storage::ClosureRemovedEvent{{{1, 9}, 1}}, 77};
  EXPECT_EQ(event_message(event).time_us(), 5);
  EXPECT_EQ(event_message(event).author(), "anna");
  event.submitted = {};
  EXPECT_EQ(event_message(event).time_us(), 77);
  EXPECT_EQ(event_message(event).author(), "relmapd");
}

TEST_F(MapWatchTest, TellsEveryKindOfEventWithWhoDidIt) {
  const storage::EventContent contents[] = {
      storage::SessionEvent{1, Uuid{{7}}, "cart", "morning", storage::SessionState::kOpen},
      added(1, 0),
      storage::SkippedEvent{1, {1, 2, 0, true, Reason::CORRUPT}},
      storage::ClosureEvent{{{1, 9}, 1},
                            {1, 2},
                            storage::EdgeKind::kLoop,
                            storage::EdgeState::kAccepted,
                            Reason::CONSISTENT,
                            true,
                            SE3(),
                            storage::Verification::kStereo,
                            30,
                            0.9f,
                            0.5f},
      storage::LabelsEvent{{1, 9}, {"dock", "gate"}},
      storage::FramesMovedEvent{{{1, 2, 9}}},
      storage::ClosureRemovedEvent{{{1, 9}, 1}},
      storage::FramesRemovedEvent{1, 5},
      storage::SessionDeletedEvent{1, Uuid{{7}}}};
  std::uint64_t sequence = 0;
  for (const auto& content : contents) log_.append({++sequence, 0}, content, "anna");
  commit(sequence);
  auto watcher = from_oldest();
  const auto messages = all(watcher);
  ASSERT_THAT(kinds(messages),
              ElementsAre(Kind::kSessionChanged, Kind::kFramesAdded, Kind::kSkipped, Kind::kEdgeChanged,
                          Kind::kFrameLabels, Kind::kFramesMoved, Kind::kEdgeRemoved, Kind::kFramesRemoved,
                          Kind::kSessionDeleted, Kind::kCaughtUp));
  for (std::size_t i = 0; i + 1 < messages.size(); ++i) {
    EXPECT_EQ(messages[i].author(), "anna");
    EXPECT_EQ(messages[i].journal_sequence(), i + 1);
    EXPECT_EQ(messages[i].time_us(), static_cast<std::int64_t>(1'000'001 + i));
    EXPECT_EQ(read_watch_token(messages[i].resume_token()).or_throw(), (WatchToken{kMap, {i + 1, 0}}));
  }
  EXPECT_EQ(messages[0].session_changed().name(), "morning");
  EXPECT_FALSE(messages[1].frames_added().frames(0).has_previous_from_this());
  EXPECT_EQ(messages[2].skipped().reason(), v1::REASON_CORRUPT);
  EXPECT_TRUE(messages[2].skipped().refused());
  const v1::Edge& edge = messages[3].edge_changed();
  EXPECT_EQ(edge.b().index(), 9u);
  EXPECT_EQ(edge.a().index(), 2u);
  EXPECT_EQ(edge.state(), v1::EDGE_STATE_ACCEPTED);
  EXPECT_EQ(edge.inliers(), 30u);
  EXPECT_THAT(messages[4].frame_labels().labels(), ElementsAre("dock", "gate"));
  EXPECT_EQ(messages[5].frames_moved().ranges(0).last(), 9u);
  EXPECT_EQ(messages[6].edge_removed().edge().ordinal(), 1u);
  EXPECT_EQ(messages[7].frames_removed().first(), 5u);
  EXPECT_EQ(messages[8].session_deleted().session(), 1u);
  EXPECT_EQ(messages[9].caught_up().journal_sequence(), sequence);
  EXPECT_EQ(feed_.counts().told, 9u);
  EXPECT_EQ(feed_.counts().lag, 0u);
}

TEST_F(MapWatchTest, MergesFramesThatFollowEachOther) {
  for (std::uint32_t i = 0; i < 600; ++i) log_.append({1 + i, 0}, added(1, i));
  log_.append({601, 0}, added(2, 0));
  log_.append({602, 0}, added(1, 600));
  commit(602);
  auto watcher = from_oldest();
  const auto messages = all(watcher);
  std::vector<int> frames;
  for (const auto& message : messages)
    if (message.has_frames_added()) frames.push_back(message.frames_added().frames_size());
  EXPECT_THAT(frames, ElementsAre(256, 256, 90));
  EXPECT_EQ(messages[1].frames_added().frames(0).frame().index(), 256u);
  EXPECT_EQ(messages[0].journal_sequence(), 256u);
  EXPECT_EQ(feed_.counts().told, 602u);
  // The token of a message is that of its last frame.
  auto again = resumed(messages[1].resume_token());
  EXPECT_EQ(all(again).front().frames_added().frames(0).frame().index(), 512u);
}

TEST_F(MapWatchTest, ManyRangesOfFramesMovedAreToldInPiecesThatAreRepeatedTogether) {
  storage::FramesMovedEvent moved;
  for (std::uint32_t i = 0; i < 600; ++i) moved.ranges.push_back({1, 10 * i, 10 * i + 3});
  log_.append({5, storage::kMovedOrdinal}, moved);
  commit(5);
  auto watcher = from_oldest();
  const auto messages = all(watcher);
  ASSERT_EQ(messages.size(), 4u);
  EXPECT_EQ(messages[0].frames_moved().ranges_size(), 256);
  EXPECT_EQ(messages[2].frames_moved().ranges_size(), 88);
  auto again = resumed(messages[1].resume_token());
  EXPECT_EQ(all(again).size(), 4u);
  auto after = resumed(messages[2].resume_token());
  EXPECT_THAT(kinds(all(after)), ElementsAre(Kind::kCaughtUp));
}

TEST_F(MapWatchTest, FiltersBySessionAndMotionAndMovesTheTokenNevertheless) {
  log_.append({1, 0}, storage::SessionEvent{1, {}, "a", "a", {}});
  log_.append({2, 0}, storage::SessionEvent{2, {}, "b", "b", {}});
  log_.append({3, 0}, added(1, 0));
  log_.append({4, 0}, added(2, 0));
  log_.append({5, 0}, closure({{2, 0}, 1}, {1, 0}));
  log_.append({6, 0}, closure({{2, 0}, 2}, {3, 0}));
  log_.append({7, 0}, storage::FramesMovedEvent{{{1, 0, 3}, {2, 0, 3}}});
  log_.append({8, 0}, storage::ClosureRemovedEvent{{{2, 0}, 1}});
  log_.append({9, 0}, storage::SessionDeletedEvent{2, {}});
  commit(9);
  v1::WatchMapRequest request;
  request.add_sessions(1);
  auto of_one = from_oldest(request);
  const auto messages = all(of_one);
  EXPECT_THAT(kinds(messages), ElementsAre(Kind::kSessionChanged, Kind::kFramesAdded, Kind::kEdgeChanged,
                                           Kind::kFramesMoved, Kind::kEdgeRemoved, Kind::kCaughtUp));
  EXPECT_EQ(messages[1].frames_added().frames_size(), 1);
  EXPECT_EQ(messages[3].frames_moved().ranges_size(), 1);
  EXPECT_EQ(read_watch_token(of_one.token).or_throw().at, (storage::EventPosition{9, storage::kMovedOrdinal}));

  request.clear_sessions();
  request.set_no_frames(true);
  auto still = from_oldest(request);
  EXPECT_THAT(kinds(all(still)),
              ElementsAre(Kind::kSessionChanged, Kind::kSessionChanged, Kind::kEdgeChanged, Kind::kEdgeChanged,
                          Kind::kEdgeRemoved, Kind::kSessionDeleted, Kind::kCaughtUp));
}

TEST_F(MapWatchTest, BeginsNowUnlessItIsAskedForMore) {
  log_.append({1, 0}, added(1, 0));
  commit(1);
  auto watcher = begin({}).or_throw();
  EXPECT_THAT(kinds(all(watcher)), ElementsAre(Kind::kCaughtUp));
  EXPECT_FALSE(next(watcher));
  log_.append({2, 0}, added(1, 1));
  commit(2);
  const auto messages = all(watcher);
  ASSERT_THAT(kinds(messages), ElementsAre(Kind::kFramesAdded, Kind::kCaughtUp));
  EXPECT_EQ(messages[0].frames_added().frames(0).frame().index(), 1u);
}

TEST_F(MapWatchTest, ReadsTheLogOnlyAfterACommit) {
  log_.append({1, 0}, added(1, 0));
  commit(1);
  auto watcher = from_oldest();
  all(watcher);
  const std::size_t reads = log_.reads();
  EXPECT_FALSE(next(watcher));
  EXPECT_FALSE(next(watcher));
  EXPECT_EQ(log_.reads(), reads);
}

TEST_F(MapWatchTest, SaysEveryQuarterOfAMinuteThatItLives) {
  commit(3);
  auto watcher = from_oldest();
  all(watcher);
  EXPECT_FALSE(next(watcher));
  now_ += std::chrono::seconds(13);
  EXPECT_FALSE(next(watcher));
  now_ += std::chrono::seconds(1);
  EXPECT_EQ(next(watcher)->caught_up().journal_sequence(), 3u);
  EXPECT_FALSE(next(watcher));
}

TEST_F(MapWatchTest, GoesOnAfterATokenWhereverItWasTaken) {
  for (std::uint32_t i = 0; i < 20; ++i) log_.append({1 + i, 0}, storage::LabelsEvent{{1, i}, {"label"}});
  commit(20);
  auto watcher = from_oldest();
  const auto messages = all(watcher);
  for (std::size_t i = 0; i + 1 < messages.size(); ++i) {
    auto again = resumed(messages[i].resume_token());
    const auto rest = all(again);
    ASSERT_EQ(rest.size(), messages.size() - 1 - i);
    if (rest.size() > 1) {
      EXPECT_EQ(rest.front().frame_labels().frame().index(), i + 1);
    }
  }
}

TEST_F(MapWatchTest, AMangledTokenIsRefused) {
  v1::WatchMapRequest request;
  request.set_resume_token("yesterday");
  EXPECT_EQ(begin(request).reason(), Reason::INVALID_ARGUMENT);
  request.clear_resume_token();
  request.set_from(static_cast<v1::WatchFrom>(17));
  EXPECT_EQ(begin(request).reason(), Reason::INVALID_ARGUMENT);
}

TEST_F(MapWatchTest, ATokenOfAnotherMapOrOfOneThatWasRestoredStartsAnew) {
  log_.append({1, 0}, added(1, 0));
  commit(1);
  for (const MapIdentity& other : {MapIdentity{Uuid{{1}}, 5}, MapIdentity{kMap.uuid, 4}}) {
    auto watcher = resumed(watch_token_text({other, {1, 0}}));
    const auto messages = all(watcher);
    ASSERT_THAT(kinds(messages), ElementsAre(Kind::kResync, Kind::kCaughtUp));
    EXPECT_EQ(messages[0].resync().reason(), v1::REASON_WRONG_MAP);
    EXPECT_EQ(messages[0].resync().missed_after(), 0u);
    EXPECT_EQ(messages[0].resync().missed_before(), 2u);
    auto again = resumed(messages[0].resume_token());
    EXPECT_THAT(kinds(all(again)), ElementsAre(Kind::kCaughtUp)) << "it has been told";
  }
  // As after a repair that lost the end of the journal.
  auto ahead = resumed(watch_token_text({kMap, {99, 0}}));
  EXPECT_THAT(kinds(all(ahead)), ElementsAre(Kind::kResync, Kind::kCaughtUp));
}

TEST_F(MapWatchTest, WhoIsTooSlowIsToldWhatIsMissingAndGoesOnFromNow) {
  for (std::uint32_t i = 0; i < 10; ++i) log_.append({1 + i, 0}, storage::LabelsEvent{{1, i}, {"label"}});
  commit(10);
  auto watcher = from_oldest();
  all(watcher);
  const std::string token = watcher.token;
  for (std::uint32_t i = 10; i < 30; ++i) log_.append({1 + i, 0}, storage::LabelsEvent{{1, i}, {"label"}});
  log_.forget({20, 0});
  commit(30);
  auto late = resumed(token);
  for (Watcher* one : {&watcher, &late}) {
    const auto messages = all(*one);
    ASSERT_THAT(kinds(messages), ElementsAre(Kind::kResync, Kind::kCaughtUp));
    EXPECT_EQ(messages[0].resync().reason(), v1::REASON_VIEW_EXPIRED);
    EXPECT_EQ(messages[0].resync().missed_after(), 10u);
    EXPECT_EQ(messages[0].resync().missed_before(), 31u);
  }
  EXPECT_EQ(feed_.counts().resyncs, 2u);
  log_.append({31, 0}, storage::LabelsEvent{{1, 30}, {"label"}});
  commit(31);
  EXPECT_THAT(kinds(all(watcher)), ElementsAre(Kind::kFrameLabels, Kind::kCaughtUp));
}

TEST_F(MapWatchTest, ATokenOfAnEmptyLogKnowsWhatItMissed) {
  commit(4);  // nothing in it is told of
  auto watcher = begin({}).or_throw();
  all(watcher);
  log_.append({5, 0}, storage::LabelsEvent{{1, 0}, {"label"}});
  log_.append({6, 0}, storage::LabelsEvent{{1, 1}, {"label"}});
  log_.forget({5, 0});
  commit(6);
  auto later = resumed(watcher.token);
  EXPECT_THAT(kinds(all(later)), ElementsAre(Kind::kResync, Kind::kCaughtUp));
}

TEST_F(MapWatchTest, StorageComesFirstAndRobotsWhenTheyChange) {
  auto watcher = from_oldest();
  std::optional<v1::MapEvent> first = next(watcher);
  ASSERT_TRUE(first && first->has_storage_changed());
  EXPECT_EQ(first->storage_changed().reason(), v1::REASON_OK);
  EXPECT_TRUE(next(watcher)->has_caught_up());
  v1::Robot robot;
  robot.set_uuid("u");
  robot.set_robot("cart");
  script_.set_storage({Reason::DISK_FULL, "no room"});
  script_.set_robots({robot});
  std::vector<v1::MapEvent> messages;
  while (messages.size() < 2)  // the feed looks once a second
    if (const auto message = next(watcher); message && !message->has_caught_up()) messages.push_back(*message);
  EXPECT_EQ(messages[0].storage_changed().message(), "no room");
  EXPECT_EQ(messages[1].robot_changed().robot(), "cart");
}

TEST_F(MapWatchTest, ReadsInStepsAndLetsOthersHaveTheirTurn) {
  ScriptedLog slow(3);
  for (std::uint32_t i = 0; i < 10; ++i) slow.append({1 + i, 0}, added(7, i));
  commit(10);
  v1::WatchMapRequest request;
  request.set_from(v1::WATCH_FROM_OLDEST);
  request.add_sessions(1);
  const auto watch = MapWatch::begin(request, kMap, slow.reader(), feed_).or_throw();
  int turns = 0;
  for (;;) {
    const auto next = watch->next([] {}, now_).or_throw();
    if (const auto* message = std::get_if<v1::MapEvent>(&*next)) {
      if (message->has_caught_up()) break;
      continue;
    }
    if (std::get<Waiting>(*next).until <= now_) ++turns;
  }
  EXPECT_EQ(turns, 3) << "between its four reads, none of which had anything for it";
}

}  // namespace
}  // namespace relmap::rpc
