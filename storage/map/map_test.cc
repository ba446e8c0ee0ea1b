#include "storage/map/map.h"

#include <gtest/gtest.h>

#include <map>

#include "storage/engine/memory_engine.h"
#include "storage/format/chunk_codec.h"
#include "storage/format/digest_codec.h"
#include "storage/format/frame_codec.h"
#include "storage/format/keys.h"
#include "storage/format/state_codec.h"
#include "storage/testing/digest_oracle.h"
#include "storage/testing/fault_engine.h"
#include "storage/testing/forgetful_files.h"
#include "storage/testing/random_frames.h"

namespace relmap::storage {
namespace {

struct MapTest : ::testing::Test {
  std::shared_ptr<Engine> engine = make_memory_engine();
  std::uint64_t epoch = engine->acquire().value();
  std::shared_ptr<Budget> budget = std::make_shared<Budget>(std::size_t{64} << 20);
  RandomFrames random{7};

  std::unique_ptr<Map> open() { return Map::open(engine, epoch, budget).value(); }

  void begin(Map& map, SessionNumber number) {
    Session session = random.session(number);
    session.first = session.last = session.frames = 0;
    map.add_session(session);
  }
  void add(Map& map, FrameId id) {
    FrameCold cold = random.cold();
    FrameHot hot = random.hot(id);
    hot.appearance_count = static_cast<std::uint32_t>(cold.appearance.size());
    map.add_frame(id, std::move(hot), random.warm(), std::move(cold));
    Session& session = map.edit_session(id.session);
    session.last = id.index;
    ++session.frames;
  }
  // Removes the last chunk of a session, which is being deleted from then on.
  void remove_chunk(Map& map, SessionNumber number) {
    if (map.session(number)->frames == 0) return;
    map.edit_session(number).state = SessionState::kDeleting;
    map.remove_last_chunk(number);
  }
  std::size_t keys(std::string_view prefix) const {
    std::size_t count = 0;
    EXPECT_TRUE(engine->snapshot()->scan(prefix, [&](auto, auto) { return ++count > 0; }).ok());
    return count;
  }
};

TEST_F(MapTest, EventsAreChargedUntilTheyAreCommittedAndSurviveAFailedCommit) {
  const auto faults = std::make_shared<Faults>();
  engine = open_fault_engine(ForgetfulFiles::create(3), faults).value();
  epoch = engine->acquire().value();
  const auto map = open();
  const std::size_t before = budget->used(Share::kDirty);
  const auto record = [&](std::uint64_t sequence) {
    map->record({{sequence, 0}, {}, std::string(1000, 'n'), ClosureRemovedEvent{{{1, 2}, 3}}});
    map->note_moved({1, 7});
    map->state().applied_sequence = sequence;
  };
  record(1);
  EXPECT_GT(budget->used(Share::kDirty), before + 1000);
  EXPECT_EQ(map->dirty_bytes(), budget->used(Share::kDirty) - before);
  faults->commits = 1;
  EXPECT_FALSE(map->commit().ok());
  record(2);
  EXPECT_GT(budget->used(Share::kDirty), before + 2000);
  ASSERT_TRUE(map->commit().ok());
  EXPECT_EQ(budget->used(Share::kDirty), before);
  EXPECT_EQ(map->dirty_bytes(), 0u);
  const EventsRead read = read_events(*map->view()->committed(), {}, 1u << 20).value();
  ASSERT_EQ(read.events.size(), 3u);
  EXPECT_EQ(read.events[0].at, (EventPosition{1, 0}));
  EXPECT_EQ(read.events[1].at, (EventPosition{2, 0}));
  EXPECT_EQ(read.events[2].at, (EventPosition{2, kMovedOrdinal}));
}

TEST_F(MapTest, SkippedSequencesAreFoundBySequence) {
  auto map = open();
  for (const SessionNumber number : {1u, 2u}) begin(*map, number);
  const Session before = *map->session(1);
  std::vector<Skipped> all;
  const auto found = [](const Graph& graph, std::uint32_t from) {
    std::vector<Skipped> items;
    graph.visit_skipped(1, from, [&](const Skipped& item) { return items.push_back(item), true; });
    return items;
  };
  map->skip(2, {0, 5, 0, false, Reason::CAPTURE_FAILED});
  for (std::uint32_t from = 20000; from < 20100; from += 10) {
    const bool refused = from % 20 == 0;
    all.push_back({from, from + (refused ? 0 : 4), refused ? from : 0, refused, Reason::CORRUPT});
    const auto view = map->view();
    map->skip(1, all.back());
    EXPECT_EQ(found(*view, 0).size(), all.size() - 1);
    EXPECT_EQ(found(*map, 0), all);
    EXPECT_EQ(found(*map->publish(), 0), all);
    if (from % 30 == 0) {
      ASSERT_TRUE(map->commit().ok());
    }
  }
  EXPECT_EQ(map->session(1)->refused, before.refused + 5);
  EXPECT_EQ(map->session(1)->given_up, before.given_up + 25);
  EXPECT_EQ(map->session(1)->next_sequence, 20095u);
  EXPECT_EQ(found(*map, 20054).front(), all[5]);
  EXPECT_EQ(found(*map, 20055).front(), all[6]);
  EXPECT_TRUE(found(*map, 20095).empty());
  std::size_t visited = 0;
  map->visit_skipped(1, 0, [&](const Skipped&) { return ++visited < 3; });
  EXPECT_EQ(visited, 3u);
  ASSERT_TRUE(map->commit().ok());
  EXPECT_EQ(budget->used(Share::kDirty), 0u);
  EXPECT_EQ(found(*open(), 0), all);
}

// Far more sessions than stay in memory: each view has all as they were when it was published.
TEST_F(MapTest, SessionsArePaged) {
  constexpr SessionNumber kSessions = 3 * 1024 + 100;
  auto map = open();
  for (SessionNumber number = 1; number <= kSessions; ++number) {
    Session session = random.session(number);
    session.state = number % 10 == 0 ? SessionState::kDeleting : SessionState::kOpen;
    session.header.oneway = number % 3 == 0;
    session.frames = 0;
    session.next_sequence = 0;
    map->add_session(session);
    if (number % 700 == 0) {
      ASSERT_TRUE(map->commit().ok());
    }
  }
  ASSERT_TRUE(map->commit().ok());
  const std::size_t held = budget->used(Share::kSessions);
  EXPECT_LT(held, kSessions * sizeof(Session) / 10) << "what is committed is on disk, or in the cache";

  const auto before = map->view();
  map->edit_session(5).next_sequence = 77;
  map->edit_session(3000).next_sequence = 77;
  const auto edited = map->publish();
  ASSERT_TRUE(map->commit().ok());
  for (SessionNumber number = 100; number < 1300; ++number) map->edit_session(number).next_sequence = 1;
  ASSERT_TRUE(map->commit().ok());
  const auto after = map->view();
  for (const auto& [view, next] : {std::pair(before, 0u), std::pair(edited, 77u), std::pair(after, 77u)}) {
    EXPECT_EQ(view->session(5)->next_sequence, next);
    EXPECT_EQ(view->session(3000)->next_sequence, next);
    EXPECT_EQ(view->session(99)->next_sequence, 0u);
    EXPECT_EQ(view->session(100)->next_sequence, view == after ? 1u : 0u);
    EXPECT_EQ(view->session(kSessions + 1), std::nullopt);
    SessionNumber expected = 0;
    for (const Session& session : view->sessions()) {
      EXPECT_EQ(session.number, ++expected);
      EXPECT_EQ(session.next_sequence, view->session(session.number)->next_sequence);
    }
    EXPECT_EQ(expected, kSessions);
    EXPECT_EQ(view->session_counts().all, kSessions - kSessions / 10);
    EXPECT_EQ(view->session_counts().oneway, kSessions / 3 - kSessions / 30);
  }
  std::vector<SessionNumber> some;
  after->visit_sessions(1299, [&](const Session& session) {
    some.push_back(session.number);
    return some.size() < 3;
  });
  EXPECT_EQ(some, (std::vector<SessionNumber>{1299, 1300, 1301}));

  map->edit_session(1).state = SessionState::kDeleting;
  EXPECT_EQ(map->publish()->session_counts().all, kSessions - kSessions / 10 - 1);
  ASSERT_TRUE(map->commit().ok());
  const auto again = open();
  EXPECT_EQ(again->view()->session_counts().all, map->view()->session_counts().all);
  EXPECT_EQ(again->session(1300)->next_sequence, 0u);
}

// The intake asks for the records of its robots' sessions all the time, and must not wait for the disk.
TEST_F(MapTest, ASessionThatIsHeldStaysInMemory) {
  constexpr SessionNumber kSessions = 5000;
  const auto faults = std::make_shared<Faults>();
  engine = open_fault_engine(ForgetfulFiles::create(1), faults).value();
  epoch = engine->acquire().value();
  budget = std::make_shared<Budget>(std::size_t{2} << 20);
  auto map = open();
  for (SessionNumber number = 1; number <= kSessions; ++number) begin(*map, number);
  ASSERT_TRUE(map->commit().ok());
  const auto view = map->view();
  auto held = map->hold_session(1);
  auto again = map->hold_session(1);
  (void)view->session(1);
  const auto read_others = [&] {
    for (SessionNumber number = 2; number <= kSessions; ++number) (void)view->session(number);
  };
  const auto is_in_memory = [&](const Graph& graph) {
    faults->reads = 1;
    const bool unread = [&] {
      try {
        return graph.session(1).has_value();
      } catch (const StatusError&) {
        return false;
      }
    }();
    faults->reads = 0;
    return unread;
  };
  read_others();
  EXPECT_TRUE(is_in_memory(*view));
  map->edit_session(1).next_sequence = 7;
  ASSERT_TRUE(map->commit().ok());
  again.reset();
  read_others();
  EXPECT_TRUE(is_in_memory(*map->view()));
  EXPECT_EQ(map->view()->session(1)->next_sequence, 7u);
  held.reset();
  read_others();
  EXPECT_FALSE(is_in_memory(*map->view()));
}

TEST_F(MapTest, OfADeletedSessionAlmostNothingIsLeft) {
  auto map = open();
  begin(*map, 1);
  map->edit_session(1).header.unknown = {{1000, Bytes(500)}};
  map->edit_session(1).refused = map->edit_session(1).given_up = map->edit_session(1).next_sequence = 0;
  add(*map, {1, 0});
  for (std::uint32_t from = 1; from <= 199; from += 2) map->skip(1, {from, from, from, from % 4 == 1, Reason::CORRUPT});
  map->state().gaps = 50;
  ASSERT_TRUE(map->commit().ok());
  EXPECT_EQ(keys("g"), 100u);
  remove_chunk(*map, 1);
  EXPECT_TRUE(map->session(1)->header.unknown.empty());
  map->skip(1, {300, 300, 0, true, Reason::SESSION_DELETED});
  EXPECT_EQ(map->session(1)->refused, 50u) << "what is sent to a deleted session is not recorded";
  EXPECT_EQ(map->session(1)->next_sequence, 301u);

  map->forget_skipped(1, 60);
  const auto some = map->publish();
  std::size_t left = 0;
  some->visit_skipped(1, 0, [&](const Skipped&) { return ++left > 0; });
  EXPECT_EQ(left, 40u);
  ASSERT_TRUE(map->begin_commit([] {}).ok());
  map->forget_skipped(1, 60);
  ASSERT_TRUE(map->finish_commit()->ok());
  ASSERT_TRUE(map->commit().ok());
  EXPECT_EQ(keys("g"), 0u);
  EXPECT_EQ(map->session(1)->refused + map->session(1)->given_up, 0u);
  EXPECT_EQ(map->state().gaps, 0u);
}

TEST_F(MapTest, TheLastEditsAreRememberedByTheirKeys) {
  auto map = open();
  for (std::uint64_t sequence = 1; sequence <= kRememberedEdits + 5; ++sequence) {
    map->remember_edit(sequence, {"edit " + std::to_string(sequence), sequence});
    if (sequence % 1000 == 0) {
      ASSERT_TRUE(map->commit().ok());
    }
  }
  ASSERT_TRUE(map->commit().ok());
  EXPECT_EQ(map->edits().size(), kRememberedEdits);
  EXPECT_EQ(keys("i"), kRememberedEdits);
  const auto again = open();
  EXPECT_EQ(again->edits(), map->edits());
  EXPECT_EQ(again->edits().begin()->second, (EditKey{"edit 6", 6}));
}

TEST_F(MapTest, PendingFramesAreWrittenChunkByChunkAsTheyChange) {
  auto map = open();
  begin(*map, 1);
  std::set<FrameId> expected;
  for (int step = 0; step < 500; ++step) {
    const FrameId id{1, random.below(300)};
    if (random.below(3) > 0) {
      map->state().pending.insert(id);
      expected.insert(id);
    } else {
      map->state().pending.erase(id);
      expected.erase(id);
    }
    ASSERT_EQ(map->state().pending.size(), expected.size());
    ASSERT_EQ(map->state().pending.contains(id), expected.contains(id));
    if (!expected.empty()) {
      ASSERT_EQ(map->state().pending.first(), *expected.begin());
    }
    if (step % 50 == 0) {
      ASSERT_TRUE(map->commit().ok());
      EXPECT_TRUE(open()->state().pending == map->state().pending);
    }
  }
  EXPECT_GT(budget->used(Share::kSessions), 0u);
  for (const FrameId id : expected) map->state().pending.erase(id);
  ASSERT_TRUE(map->commit().ok());
  EXPECT_EQ(keys("q"), 0u);
  map.reset();
  EXPECT_EQ(budget->used(Share::kSessions), 0u);
}

TEST_F(MapTest, RandomEditsCommittedAtRandomComeBackBitForBit) {
  auto map = open();
  for (const SessionNumber number : {1u, 2u, 3u}) begin(*map, number);
  std::map<SessionNumber, std::uint32_t> next{{1, 0}, {2, 0}, {3, 5}};
  for (int step = 0; step < 2000; ++step) {
    const SessionNumber number = 1 + random.below(3);
    const bool going = number == 3 && step > 1000;
    std::uint32_t& index = next[number];
    switch (random.below(8)) {
      case 0:
      case 1:
        if (going) {
          if (random.below(10) == 0) remove_chunk(*map, number);
          break;
        }
        index += random.below(30) == 0 ? 1 + random.below(150) : 1;  // gaps, now and then of whole chunks
        add(*map, {number, index});
        break;
      case 2:
        if (random.below(10) == 0) {
          map->state().applied_sequence += 1;
          if (!going) map->state().pending.insert({number, index});
          ASSERT_TRUE(map->commit().ok());
        }
        break;
      case 3:
        map->publish();
        if (step % 10 == 0) {
          EXPECT_EQ(digests_visited(*map->view()), digests_of_frames(*map->view()));
        }
        break;
      default: {
        const FrameId id{number, index > 0 ? random.below(index + 1) : 0};
        if (!map->hot(id)) break;
        if (random.below(2) == 0) map->edit_hot(id) = random.hot(id);
        if (random.below(4) == 0) map->edit_warm(id) = random.warm();
        if (random.below(20) == 0) map->set_label(id, "label" + std::to_string(random.below(3)), random.below(3) > 0);
        break;
      }
    }
    if (step % 300 == 299) {
      ASSERT_TRUE(map->commit().ok());
      const MapHash before = hash_map(*map);
      EXPECT_EQ(hash_map(*map->view()), before);
      const DigestsByChunk digests = digests_of_frames(*map->view());
      EXPECT_EQ(digests_visited(*map->view()), digests);
      const MapState state = map->state();
      map.reset();
      map = open();
      ASSERT_EQ(hash_map(*map), before) << step;
      EXPECT_TRUE(map->digests_hold());
      EXPECT_EQ(digests_visited(*map->view()), digests);
      EXPECT_EQ(map->state().pending, state.pending);
      EXPECT_EQ(map->state().applied_sequence, state.applied_sequence);
    }
  }
  EXPECT_TRUE(is_deleted(*map->session(3)));
  ASSERT_TRUE(map->commit().ok());  // its last chunk may have gone since
  std::size_t left = 0;
  ASSERT_TRUE(engine->snapshot()
                  ->scan("",
                         [&](std::string_view key, ByteSpan) {
                           const auto part = keys::part_of(key);
                           const auto digests = keys::digests_of(key);
                           left += (part && part->chunk.session == 3) || (digests && digests->session == 3);
                           return true;
                         })
                  .ok());
  EXPECT_EQ(left, 0u);
}

TEST_F(MapTest, ASessionIsRemovedChunkByChunkAndEarlierViewsStillHaveIt) {
  auto map = open();
  for (const SessionNumber number : {1u, 2u}) begin(*map, number);
  for (std::uint32_t i = 0; i < 200; ++i) {
    add(*map, {1, i});
    if (i < 100) add(*map, {2, i < 70 ? i : i + 300});  // with a hole of whole chunks
  }
  map->set_label({2, 380}, "dock", true);
  map->set_label({1, 3}, "dock", true);
  map->state().pending.insert({2, 380});
  ASSERT_TRUE(map->commit().ok());
  map->edit_hot({2, 380}).mean_error = 3;  // dirty as it goes
  const auto before = map->publish();
  const MapHash hash = hash_map(*before);

  remove_chunk(*map, 2);
  EXPECT_FALSE(map->hot({2, 384}) || map->warm({2, 390}) || map->cold({2, 399}));
  EXPECT_TRUE(map->hot({2, 383}));
  EXPECT_EQ(map->session(2)->last, 383u);
  EXPECT_EQ(map->session(2)->frames, 84u);
  remove_chunk(*map, 2);
  EXPECT_EQ(map->session(2)->last, 69u);
  EXPECT_EQ(map->session(2)->last_time_us, map->hot({2, 69})->time_us);
  const auto during = map->publish();
  EXPECT_FALSE(during->hot({2, 380}) || during->warm({2, 380}) || during->cold({2, 380}));
  EXPECT_EQ(during->hot_frames({2, 5})[60], nullptr);
  EXPECT_EQ(during->labelled("dock"), std::vector<FrameId>({{1, 3}}));
  EXPECT_TRUE(map->state().pending.empty());
  ASSERT_TRUE(map->commit().ok());
  EXPECT_FALSE(map->hot({2, 380}) || map->view()->hot({2, 380}) || map->view()->cold({2, 380}));
  for (int chunk = 0; chunk < 2; ++chunk) remove_chunk(*map, 2);
  EXPECT_TRUE(is_deleted(*map->session(2)));
  ASSERT_TRUE(map->commit().ok());

  EXPECT_EQ(hash_map(*before), hash);
  EXPECT_TRUE(before->cold({2, 380}) && before->warm({2, 0}));
  EXPECT_EQ(budget->used(Share::kDirty), 0u);
  EXPECT_EQ(hash_map(*open()), hash_map(*map));
  EXPECT_FALSE(open()->hot({2, 0}));
}

TEST_F(MapTest, AMapThatDoesNotFitTheCacheAnswersTheSame) {
  MapHash large, small;
  for (const std::size_t limit : {std::size_t{256} << 20, std::size_t{352} << 10}) {
    engine = make_memory_engine();
    epoch = engine->acquire().value();
    budget = std::make_shared<Budget>(limit);
    random = RandomFrames(11);
    auto map = open();
    begin(*map, 1);
    for (std::uint32_t i = 0; i < 300; ++i) {
      add(*map, {1, i});
      if (i >= 150) map->edit_hot({1, i - 150}).mean_error = static_cast<float>(i);
      if (map->dirty_bytes() > budget->allowance(Share::kDirty)) {
        ASSERT_TRUE(map->commit().ok());
      }
      map->publish();
      EXPECT_LE(budget->used(Share::kCache), budget->allowance(Share::kCache));
    }
    (limit > (1u << 20) ? large : small) = hash_map(*map->view());
    EXPECT_LE(budget->used(), limit);
  }
  EXPECT_EQ(large, small);
}

// Edits go on while a commit is being written, and commits fail now and then. No reader notices any of it, and a reload
// gives what was committed last.
TEST_F(MapTest, EditsGoOnWhileACommitIsWritten) {
  const auto faults = std::make_shared<Faults>();
  engine = open_fault_engine(ForgetfulFiles::create(1), faults).value();
  epoch = engine->acquire().value();
  auto map = open();
  MapHash begun, committed = hash_map(*map);
  for (const SessionNumber number : {1u, 2u}) begin(*map, number);
  for (std::uint32_t i = 0; i < 600; ++i) add(*map, {2, i});
  std::uint32_t frames = 0, failures = 0;
  struct Seen {
    std::shared_ptr<const MapView> view;
    MapHash hash;
    DigestsByChunk digests;
  };
  std::vector<Seen> views;
  for (int step = 0; step < 600; ++step) {
    for (int k = 0; k < 3; ++k) {
      if (random.below(3) == 0) add(*map, {1, frames++});
      if (frames == 0) continue;
      const FrameId id{1, random.below(frames)};
      if (random.below(4) == 0) map->edit_hot(id).edges = random.hot(id).edges;
      if (random.below(2) == 0) map->edit_hot(id).mean_error = static_cast<float>(step);
      if (random.below(4) == 0) map->edit_warm(id) = random.warm();
      if (random.below(4) == 0) map->set_label(id, "label" + std::to_string(random.below(3)), random.below(2) == 0);
      if (random.below(4) == 0) map->state().pending.insert(id);
      if (random.below(4) == 0) map->state().pending.erase(id);
    }
    if (random.below(40) == 0) remove_chunk(*map, 2);
    if (step % 40 == 0) map->skip(1, {100000u + static_cast<std::uint32_t>(step), 100000u + step, 1, true, {}});
    if (random.below(2) == 0) map->publish();
    if (step % 7 == 0) {
      const auto view = map->publish();
      views.push_back({view, hash_map(*map), digests_of_frames(*view)});
      EXPECT_EQ(digests_visited(*view), views.back().digests);
    }
    if (step % 5 != 0) continue;
    const bool fails = random.below(4) == 0;
    if (const auto outcome = map->finish_commit()) {
      if (outcome->ok()) committed = begun;
      failures += !outcome->ok();
      EXPECT_EQ(hash_map(*open()), committed) << step;
      EXPECT_EQ(digests_visited(*open()->view()), digests_of_frames(*open()->view())) << step;
    }
    faults->commits = fails ? 1 : 0;
    map->publish();
    begun = hash_map(*map);
    ASSERT_TRUE(map->begin_commit({}).ok());
    if (views.size() > 8) {
      for (const auto& [view, hash, digests] : views) {
        EXPECT_EQ(hash_map(*view), hash);
        EXPECT_EQ(digests_visited(*view), digests);
      }
      views.clear();
    }
  }
  EXPECT_GT(failures, 5u);
  EXPECT_LT(failures, 60u);
  faults->commits = 0;
  ASSERT_TRUE(map->commit().ok());
  EXPECT_EQ(map->dirty_bytes(), 0u);
  EXPECT_EQ(budget->used(Share::kDirty), 0u);
  EXPECT_EQ(hash_map(*open()), hash_map(*map));
  EXPECT_TRUE(open()->digests_hold());
  EXPECT_EQ(digests_visited(*open()->view()), digests_of_frames(*map));
  EXPECT_TRUE(open()->state().pending == map->state().pending);
  for (int k = 0; k < 3; ++k) {
    const std::string label = "label" + std::to_string(k);
    EXPECT_EQ(open()->labelled(label), map->labelled(label));
  }
  views.clear();
  EXPECT_EQ(budget->used(Share::kViews), 0u);
}

TEST_F(MapTest, AnOpenChunkIsWrittenFrameByFrameAndGatheredWhenItCloses) {
  auto map = open();
  begin(*map, 1);
  for (std::uint32_t i = 0; i < kFramesPerChunk; ++i) add(*map, {1, i});
  ASSERT_TRUE(map->commit().ok());
  const std::string hot = keys::part(Part::kHot, {1, 0}), warm = keys::part(Part::kWarm, {1, 0});
  EXPECT_EQ(keys(hot), kFramesPerChunk);
  EXPECT_FALSE(engine->snapshot()->get(hot).value());

  add(*map, {1, kFramesPerChunk});  // of the next chunk
  ASSERT_TRUE(map->commit().ok());
  EXPECT_EQ(keys(hot), 1u);
  EXPECT_EQ(keys(warm), 1u);
  EXPECT_TRUE(engine->snapshot()->get(hot).value());
}

TEST_F(MapTest, AnEditOfTheHotPartLeavesTheOtherBytesAlone) {
  auto map = open();
  begin(*map, 1);
  for (std::uint32_t i = 0; i < 2 * kFramesPerChunk; ++i) add(*map, {1, i});
  ASSERT_TRUE(map->commit().ok());
  const auto before = engine->snapshot();
  map->edit_hot({1, 3}).mean_error = 1;
  ASSERT_TRUE(map->commit().ok());
  const auto after = engine->snapshot();
  std::vector<std::string> changed;
  ASSERT_TRUE(after
                  ->scan("",
                         [&](std::string_view key, ByteSpan value) {
                           const auto old = before->get(key).value();
                           if (!old || !std::equal(value.begin(), value.end(), old->begin(), old->end()))
                             changed.emplace_back(key);
                           return true;
                         })
                  .ok());
  EXPECT_EQ(changed, (std::vector<std::string>{keys::part(Part::kHot, {1, 0}), keys::map_state()}))
      << "the state says as of which commit the digests are right";
}

// Parts name the commit that wrote them. In a map that an older version migrated from format 1 they may name commits
// to come.
TEST_F(MapTest, AnEditIsKeptWhicheverCommitAPartNames) {
  {
    auto map = open();
    begin(*map, 1);
    for (std::uint32_t i = 0; i < 2 * kFramesPerChunk; ++i) {
      add(*map, {1, i});
      if (i % 16 == 15) throw_if(map->commit());
    }
  }
  std::vector<Put> puts;
  ASSERT_TRUE(engine->snapshot()
                  ->scan("",
                         [&](std::string_view key, ByteSpan value) {
                           puts.push_back({std::string(key), {value.begin(), value.end()}});
                           return true;
                         })
                  .ok());
  engine = make_memory_engine();
  epoch = engine->acquire().value();
  ASSERT_TRUE(engine->commit(epoch, 0, puts, {}).ok());
  auto map = open();
  const FrameId closed{1, 3}, last{1, 2 * kFramesPerChunk - 1};
  for (int commits = 1; commits < 20; ++commits) {
    for (const FrameId frame : {closed, last}) map->edit_hot(frame).mean_error = commits;
    ASSERT_TRUE(map->commit().ok());
    for (const FrameId frame : {closed, last}) {
      EXPECT_EQ(map->hot(frame)->mean_error, commits) << frame.to_string();
      EXPECT_EQ(map->view()->hot(frame)->mean_error, commits) << frame.to_string();
    }
  }
}

TEST_F(MapTest, AFailedCommitLosesNothingAndCanBeRepeated) {
  const auto disk = ForgetfulFiles::create(1);
  const auto faults = std::make_shared<Faults>();
  engine = open_fault_engine(disk, faults).value();
  epoch = engine->acquire().value();
  auto map = open();
  begin(*map, 1);
  for (std::uint32_t i = 0; i < 100; ++i) add(*map, {1, i});
  const auto view = map->publish();
  const MapHash hash = hash_map(*map);
  faults->commits = 1;
  EXPECT_EQ(map->commit().reason(), Reason::IO_ERROR);
  EXPECT_GT(map->dirty_bytes(), 0u);
  EXPECT_EQ(hash_map(*map->view()), hash);
  map->edit_hot({1, 1}).mean_error = 5;
  const MapHash edited = hash_map(*map);
  ASSERT_TRUE(map->commit().ok());
  EXPECT_EQ(map->dirty_bytes(), 0u);
  EXPECT_EQ(budget->used(Share::kDirty), 0u);
  map = open();
  EXPECT_EQ(hash_map(*map), edited);
  EXPECT_EQ(hash_map(*view), hash);
}

TEST_F(MapTest, AReadThatFailsIsAnErrorAndNotAnEmptyMap) {
  const auto faults = std::make_shared<Faults>();
  engine = open_fault_engine(ForgetfulFiles::create(1), faults).value();
  epoch = engine->acquire().value();
  {
    auto map = open();
    begin(*map, 1);
    add(*map, {1, 0});
    ASSERT_TRUE(map->commit().ok());
  }
  const auto map = open();
  faults->reads = 1;
  try {
    map->hot({1, 0});
    FAIL() << "no error";
  } catch (const StatusError& error) {
    EXPECT_EQ(error.status().reason(), Reason::IO_ERROR);
  }
  EXPECT_TRUE(map->hot({1, 0}));
  faults->reads = 1;
  EXPECT_EQ(Map::open(engine, epoch, budget).reason(), Reason::IO_ERROR);
}

TEST_F(MapTest, DamagedPartsAreNamed) {
  {
    auto map = open();
    begin(*map, 1);
    for (std::uint32_t i = 0; i < 2 * kFramesPerChunk; ++i) add(*map, {1, i});
    ASSERT_TRUE(map->commit().ok());
  }
  const std::string key = keys::part(Part::kHot, {1, 0});
  Bytes bytes = engine->snapshot()->get(key).value().value();
  bytes[bytes.size() / 2] ^= 1;
  const std::vector<Put> puts{{key, bytes}};
  ASSERT_TRUE(engine->commit(epoch, 0, puts, {}).ok());
  auto map = open();
  const auto lost = [&] {
    std::vector<std::string> messages;
    for (std::uint32_t i = 0; i < kFramesPerChunk; ++i) {
      EXPECT_TRUE(map->warm({1, i}));
      try {
        map->hot({1, i});
      } catch (const StatusError& error) {
        EXPECT_EQ(error.status().reason(), Reason::DATA_LOSS);
        messages.push_back(error.status().message());
      }
    }
    return messages;
  };
  const auto before = lost();
  ASSERT_EQ(before.size(), 1u);  // the others are as readable as ever
  EXPECT_NE(before[0].find("hot part of frame 1:"), std::string::npos) << before[0];

  // A commit that writes other frames of the chunk keeps the damage as it is, neither hidden nor spread.
  std::uint32_t sound = 0;
  while (before[0].find("1:" + std::to_string(sound) + ":") != std::string::npos) ++sound;
  map->edit_hot({1, sound}).mean_error = 0.5F;
  ASSERT_TRUE(map->commit().ok());
  EXPECT_EQ(lost(), before);
  map = open();
  EXPECT_EQ(lost(), before);
  EXPECT_EQ(map->hot({1, sound})->mean_error, 0.5F);
  EXPECT_TRUE(map->hot({1, kFramesPerChunk}));
}

TEST_F(MapTest, DigestsAreVisitedFromAnyChunkOnUntilToldToStop) {
  auto map = open();
  for (const SessionNumber number : {1u, 2u, 4u}) begin(*map, number);
  for (std::uint32_t i = 0; i < 130; ++i)
    for (const SessionNumber number : {1u, 4u}) add(*map, {number, i});
  ASSERT_TRUE(map->commit().ok());
  for (std::uint32_t i = 0; i < 70; ++i) add(*map, {2, 200 + i});  // not committed
  map->edit_hot({1, 70}) = random.hot({1, 70});
  const auto view = map->publish();
  const DigestsByChunk all = digests_of_frames(*view);
  EXPECT_EQ(all.size(), 8u);
  for (const ChunkId from : {ChunkId{}, ChunkId{1, 1}, ChunkId{1, 2}, ChunkId{2, 0}, ChunkId{2, 4}, ChunkId{4, 3}})
    EXPECT_EQ(digests_visited(*view, from), DigestsByChunk(all.lower_bound(from), all.end())) << from.to_string();
  for (std::size_t most = 1; most < 8; ++most) {
    std::size_t visited = 0;
    EXPECT_TRUE(view->visit_digests({}, [&](const ChunkDigest&) { return ++visited < most; }).ok());
    EXPECT_EQ(visited, most);
  }
}

// A program that knows nothing of digests keeps what it does not know, and commits frames without them.
TEST_F(MapTest, DigestsOfAnotherCommitAreNotBelievedAndMadeAnew) {
  {
    auto map = open();
    for (const SessionNumber number : {1u, 2u, 3u}) begin(*map, number);
    for (std::uint32_t i = 0; i < 200; ++i)
      for (const SessionNumber number : {1u, 2u}) add(*map, {number, i});
    for (std::uint32_t i = 0; i < 20; ++i) add(*map, {3, i});
    ASSERT_TRUE(map->commit().ok());
    EXPECT_TRUE(open()->digests_hold());
  }
  const std::string key = keys::part(Part::kHot, {1, 1});
  PartWriter writer(Part::kHot, {1, 1}, 9);
  for (std::uint32_t slot = 0; slot < 10; ++slot) {
    ByteWriter body;
    encode_hot(body, frame_in({1, 1}, slot), random.hot(frame_in({1, 1}, slot)));
    writer.add(slot, body.bytes());
  }
  std::vector<std::string> gone;
  for (std::uint32_t i = 0; i < 20; ++i) gone.push_back(keys::frame(Part::kHot, {3, i}));
  ASSERT_TRUE(engine->commit(epoch, 0, std::vector<Put>{{key, writer.finish()}}, gone).ok());

  auto map = open();
  EXPECT_FALSE(map->digests_hold());
  const auto expected = [&] {
    DigestsByChunk frames = digests_of_frames(*map->view());
    EXPECT_EQ(frames.size(), 8u);
    return frames;
  };
  EXPECT_EQ(digests_visited(*map->view()), expected()) << "made from the frames";
  map->edit_hot({2, 70}) = random.hot({2, 70});
  add(*map, {1, 200});
  map->publish();
  EXPECT_EQ(digests_visited(*map->view()), expected());
  ASSERT_TRUE(map->commit().ok());
  EXPECT_FALSE(open()->digests_hold()) << "not before they are made anew";
  EXPECT_EQ(digests_visited(*open()->view()), expected());

  map->edit_hot({2, 71}) = random.hot({2, 71});
  const auto before = map->publish();
  const MapHash hash = hash_map(*before);
  const DigestsByChunk digests = expected();
  std::uint64_t done = 0;
  ASSERT_TRUE(map->rebuild_digests([&](std::uint64_t frames, std::uint64_t) { return done = frames, true; }).ok());
  EXPECT_TRUE(map->digests_hold());
  EXPECT_EQ(keys("d"), 8u) << "those of chunks that are gone are deleted";
  EXPECT_EQ(digests_visited(*map->view()), digests);
  EXPECT_EQ(digests_visited(*before), digests);
  EXPECT_EQ(hash_map(*map->view()), hash);
  EXPECT_FALSE(hash_map(*open()) == hash) << "what was dirty still is";
  EXPECT_TRUE(open()->digests_hold());
  ASSERT_TRUE(map->commit().ok());
  EXPECT_EQ(hash_map(*open()), hash);
  EXPECT_EQ(digests_visited(*open()->view()), digests);
  EXPECT_EQ(budget->used(Share::kDirty), 0u);
}

TEST_F(MapTest, MakingDigestsAnewGoesOnAfterItWasStoppedOrFailed) {
  const auto faults = std::make_shared<Faults>();
  engine = open_fault_engine(ForgetfulFiles::create(1), faults).value();
  epoch = engine->acquire().value();
  auto map = open();
  begin(*map, 1);
  FrameHot hot = random.hot({1, 0});
  hot.edges.assign(30, random.edge({1, 0}, 1));
  for (std::uint32_t i = 0; i < 1000; ++i) {
    add(*map, {1, i});
    map->edit_hot({1, i}).edges = hot.edges;
  }
  ASSERT_TRUE(map->commit().ok());
  const DigestsByChunk expected = digests_of_frames(*map->view());
  std::uint64_t told = 0;
  const auto stop = [&](std::uint64_t, std::uint64_t) { return ++told, false; };
  EXPECT_EQ(map->rebuild_digests(stop).reason(), Reason::SHUTTING_DOWN);
  EXPECT_EQ(told, 1u);
  EXPECT_FALSE(map->digests_hold());
  EXPECT_FALSE(open()->digests_hold());
  EXPECT_EQ(digests_visited(*map->view()), expected);
  faults->commits = 1;
  EXPECT_EQ(map->rebuild_digests({}).reason(), Reason::IO_ERROR);
  EXPECT_EQ(digests_visited(*map->view()), expected);
  map->edit_hot({1, 5}).time_us = 1;
  ASSERT_TRUE(map->commit().ok());
  ASSERT_TRUE(map->rebuild_digests({}).ok());
  EXPECT_EQ(digests_visited(*map->view()), digests_of_frames(*map));
  EXPECT_EQ(digests_visited(*open()->view()), digests_of_frames(*map));
}

TEST_F(MapTest, DigestsThatWereMadeInPartAreCompletedUnlessTheMapWasCommittedSince) {
  {
    auto map = open();
    for (const SessionNumber number : {1u, 2u, 4u, 5u}) begin(*map, number);
    for (std::uint32_t i = 0; i < 200; ++i)
      for (const SessionNumber number : {1u, 4u}) add(*map, {number, i});
    for (std::uint32_t i = 0; i < 20; ++i)
      for (const SessionNumber number : {2u, 5u}) add(*map, {number, i});
    ASSERT_TRUE(map->commit().ok());
  }
  // As a program does that knows nothing of digests: two sessions go, one before and one behind where the first run is
  // stopped.
  std::vector<std::string> gone;
  for (std::uint32_t i = 0; i < 20; ++i)
    for (const SessionNumber number : {2u, 5u}) gone.push_back(keys::frame(Part::kHot, {number, i}));
  ASSERT_TRUE(engine->commit(epoch, 0, {}, gone).ok());
  const auto state = [&] { return decode_state(engine->snapshot()->get(keys::map_state()).value().value()).value(); };
  const auto stop_after = [&](std::uint64_t chunks) {
    auto map = open();
    std::uint64_t told = 0;
    EXPECT_EQ(map->complete_digests([&](std::uint64_t, std::uint64_t) { return ++told < chunks; }).reason(),
              Reason::SHUTTING_DOWN);
    EXPECT_EQ(told, chunks);
    EXPECT_FALSE(map->digests_hold());
    EXPECT_EQ(digests_visited(*map->view()), digests_of_frames(*map->view()));
  };
  stop_after(5);
  EXPECT_EQ(state().digests_commit, 0u);
  EXPECT_EQ(state().digests_made, (DigestsMade{engine->snapshot()->commit_number(), {4, 0}, 264}));
  EXPECT_EQ(keys("d"), 9u) << "of what is gone, all before was deleted";
  stop_after(2);
  EXPECT_EQ(state().digests_made, (DigestsMade{engine->snapshot()->commit_number(), {4, 2}, 392}));
  {
    auto map = open();
    std::uint64_t chunks = 0;
    std::uint64_t last = 0;
    ASSERT_TRUE(
        map->complete_digests([&](std::uint64_t frames, std::uint64_t) { return last = frames, ++chunks; }).ok());
    EXPECT_EQ(chunks, 1u) << "the others were made";
    EXPECT_EQ(last, 400u);
    EXPECT_EQ(state().digests_made, DigestsMade());
    EXPECT_EQ(keys("d"), 8u);
  }
  EXPECT_TRUE(open()->digests_hold());
  EXPECT_EQ(digests_visited(*open()->view()), digests_of_frames(*open()->view()));

  const auto forget = [&] {
    MapState forgetful = state();
    forgetful.digests_commit = 0;
    ASSERT_TRUE(engine->commit(epoch, 0, std::vector<Put>{{keys::map_state(), encode_state(forgetful)}}, {}).ok());
  };
  // A commit in between, of another program or this one, makes what was done in part worthless.
  const auto complete = [&] {
    std::uint64_t chunks = 0;
    EXPECT_TRUE(open()->complete_digests([&](std::uint64_t, std::uint64_t) { return ++chunks > 0; }).ok());
    EXPECT_TRUE(open()->digests_hold());
    EXPECT_EQ(digests_visited(*open()->view()), digests_of_frames(*open()->view()));
    return chunks;
  };
  forget();
  stop_after(5);
  const std::string key = keys::part(Part::kHot, {1, 1});
  PartWriter writer(Part::kHot, {1, 1}, 9);
  ByteWriter body;
  encode_hot(body, {1, 64}, random.hot({1, 64}));
  writer.add(0, body.bytes());
  ASSERT_TRUE(engine->commit(epoch, 0, std::vector<Put>{{key, writer.finish()}}, {}).ok());
  EXPECT_NE(state().digests_made, DigestsMade());
  EXPECT_EQ(complete(), 8u);
  forget();
  stop_after(5);
  {
    auto map = open();
    map->edit_hot({4, 1}).time_us = 5;
    ASSERT_TRUE(map->commit().ok());
  }
  EXPECT_EQ(state().digests_made, DigestsMade());
  EXPECT_EQ(complete(), 8u);
  // Made anew, they are made anew in whole.
  forget();
  stop_after(5);
  std::uint64_t chunks = 0;
  ASSERT_TRUE(open()->rebuild_digests([&](std::uint64_t, std::uint64_t) { return ++chunks > 0; }).ok());
  EXPECT_EQ(chunks, 8u);
}

TEST_F(MapTest, DamagedDigestsAreNamedAndMadeAnewWithTheNextEdit) {
  {
    auto map = open();
    begin(*map, 1);
    for (std::uint32_t i = 0; i < 3 * kFramesPerChunk; ++i) add(*map, {1, i});
    ASSERT_TRUE(map->commit().ok());
  }
  Bytes damaged = engine->snapshot()->get(keys::digests({1, 1})).value().value();
  damaged[damaged.size() / 2] ^= 1;
  MapState state = decode_state(engine->snapshot()->get(keys::map_state()).value().value()).value();
  ++state.digests_commit;
  ASSERT_TRUE(engine
                  ->commit(epoch, 0,
                           std::vector<Put>{{keys::digests({1, 1}), damaged}, {keys::map_state(), encode_state(state)}},
                           std::vector<std::string>{keys::digests({1, 0})})
                  .ok());
  auto map = open();
  ASSERT_TRUE(map->digests_hold());
  const Status lost = map->view()->visit_digests({}, [](const ChunkDigest&) { return true; });
  EXPECT_EQ(lost.reason(), Reason::DATA_LOSS);
  EXPECT_NE(lost.message().find("digests of chunk 1:1"), std::string::npos) << lost.message();
  EXPECT_EQ(digests_visited(*map->view(), {1, 2}).size(), 1u);
  map->edit_hot({1, 3}).time_us = 1;
  map->edit_hot({1, 70}).time_us = 1;
  ASSERT_TRUE(map->commit().ok());
  EXPECT_EQ(digests_visited(*map->view()), digests_of_frames(*map->view()));
}

TEST_F(MapTest, LabelsAreFoundWhetherCommittedOrNot) {
  auto map = open();
  begin(*map, 1);
  for (std::uint32_t i = 0; i < 4; ++i) {
    add(*map, {1, i});
    map->edit_hot({1, i}).labels.clear();
  }
  map->set_label({1, 2}, "dock", true);
  map->set_label({1, 0}, "dock", true);
  map->set_label({1, 1}, "door", true);
  const std::string odd("do\0or", 5);
  map->set_label({1, 3}, odd, true);
  using Ids = std::vector<FrameId>;
  using Names = std::vector<std::string>;
  for (const bool committed : {false, true}) {
    if (committed) {
      ASSERT_TRUE(map->commit().ok());
    }
    const auto view = map->publish();
    EXPECT_EQ(view->labelled("dock"), (Ids{{1, 0}, {1, 2}}));
    EXPECT_EQ(view->labelled(odd), (Ids{{1, 3}}));
    EXPECT_EQ(view->labelled("do"), Ids{});
    EXPECT_EQ(view->labels("do"), (Names{odd, "dock", "door"}));
    EXPECT_EQ(view->labels("doc"), (Names{"dock"}));
  }
  map->set_label({1, 2}, "dock", false);
  EXPECT_EQ(map->labelled("dock"), (Ids{{1, 0}}));
  EXPECT_EQ(map->view()->labelled("dock").size(), 2u);
  ASSERT_TRUE(map->commit().ok());
  map = open();
  EXPECT_EQ(map->labelled("dock"), (Ids{{1, 0}}));
  EXPECT_EQ(map->hot({1, 2})->labels, Names{});
}

TEST_F(MapTest, WordsAreScannedWithoutTheDescriptors) {
  auto map = open();
  begin(*map, 1);
  for (std::uint32_t i = 0; i < 100; ++i) {
    add(*map, {1, i});
    if (i == 80) {
      ASSERT_TRUE(map->commit().ok());
    }
  }
  std::vector<FrameId> seen;
  const auto view = map->publish();
  const auto none = [](FrameId) { return false; };
  const auto see = [&](FrameId id, std::span<const std::uint32_t> words) {
    seen.push_back(id);
    EXPECT_TRUE(std::equal(words.begin(), words.end(), map->cold(id)->words.begin(), map->cold(id)->words.end()));
  };
  ASSERT_TRUE(view->scan_words(none, see).ok());
  std::vector<FrameId> with_words;
  for (std::uint32_t i = 0; i < 100; ++i)
    if (!map->cold({1, i})->words.empty()) with_words.push_back({1, i});
  EXPECT_GT(with_words.size(), 80u);
  EXPECT_EQ(seen, with_words);

  seen.clear();
  ASSERT_TRUE(view->scan_words([](FrameId id) { return id.index < 70; }, see).ok());
  std::erase_if(with_words, [](FrameId id) { return id.index < 70; });
  EXPECT_EQ(seen, with_words) << "what is known is passed over";
}

TEST_F(MapTest, HashesDependOnContentAndNotOnSessionNumbers) {
  const auto build = [&](SessionNumber a, SessionNumber b, float error) {
    engine = make_memory_engine();
    epoch = engine->acquire().value();
    auto map = open();
    RandomFrames content(5);
    const Session first = content.session(0), second = content.session(0);
    for (Session session : {first, second}) {
      session.number = session.header.uuid == first.header.uuid ? a : b;
      session.first = 0, session.last = 1, session.frames = 2;
      map->add_session(session);
      for (std::uint32_t i = 0; i < 2; ++i) {
        FrameHot hot;
        hot.present = true;
        hot.mean_error = error;
        Edge edge;
        edge.id = {{session.number, i}, 0};
        edge.a = {a, 0};
        edge.b = {session.number, i};
        hot.edges = {edge};
        hot.incoming = {{{a, 1}, 1}, {{b, 1}, 1}};
        if (a > b) std::swap(hot.incoming[0], hot.incoming[1]);
        map->add_frame({session.number, i}, hot, {}, {});
      }
    }
    return hash_map(*map);
  };
  const MapHash one = build(1, 2, 0.5f);
  EXPECT_EQ(build(7, 3, 0.5f), one);
  const MapHash other = build(1, 2, 0.75f);
  EXPECT_EQ(other.structure, one.structure);
  EXPECT_NE(other.estimates, one.estimates);
}

TEST_F(MapTest, EditingWhatDoesNotExistIsRefused) {
  auto map = open();
  begin(*map, 1);
  EXPECT_THROW(map->edit_hot({1, 0}), StatusError);
  EXPECT_THROW(map->edit_warm({1, 0}), StatusError);
  EXPECT_THROW(map->edit_session(2), StatusError);
  EXPECT_EQ(map->dirty_bytes(), 0u);
}

}  // namespace
}  // namespace relmap::storage
