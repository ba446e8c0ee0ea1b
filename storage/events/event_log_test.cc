#include "storage/events/event_log.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "storage/engine/memory_engine.h"
#include "storage/events/event_block.h"
#include "storage/events/event_writer.h"
#include "storage/format/keys.h"
#include "storage/testing/random_frames.h"

namespace relmap::storage {
namespace {

constexpr std::int64_t kHour = 3600 * std::int64_t{1'000'000};
constexpr std::size_t kAll = std::size_t{1} << 30;

EventBlock block_of(const std::vector<Event>& events) {
  EventBlock block;
  for (const Event& event : events) block.add(event);
  return block;
}
// Events that are equal bit for bit have equal bytes.
Bytes bytes_of(const std::vector<Event>& events) { return block_of(events).events.take(); }

std::vector<Event> random_events(RandomFrames& random, std::size_t count) {
  std::vector<Event> events;
  EventPosition at;
  while (events.size() < count) {
    if (at.sequence > 0 && at.ordinal != kMovedOrdinal && random.below(3) == 0)
      ++at.ordinal;
    else
      at = {at.sequence + 1 + random.below(300), random.below(10) == 0 ? kMovedOrdinal : 0};
    events.push_back(random.event(at));
  }
  return events;
}

TEST(EventBlocks, GiveBackWhatWasWritten) {
  RandomFrames random(3);
  for (int round = 0; round < 50; ++round) {
    const std::vector<Event> events = random_events(random, 1 + random.below(40));
    EventBlockHeader header{1234567 + round, {}, {}, 99};
    const EventBlock block = block_of(events);
    const Bytes bytes = encode_event_block(header, block);
    EXPECT_EQ(header.bytes_through, 99 + bytes.size());
    std::vector<Event> read;
    const auto again = decode_event_block(bytes, read);
    ASSERT_TRUE(again.ok()) << again.status().to_string();
    EXPECT_EQ(again->time_us, header.time_us);
    EXPECT_EQ(again->last, events.back().at);
    EXPECT_EQ(again->bytes_through, header.bytes_through);
    ASSERT_EQ(read.size(), events.size());
    EXPECT_EQ(bytes_of(read), bytes_of(events));
    for (std::size_t i = 0; i < events.size(); ++i) {
      EXPECT_EQ(read[i].at, events[i].at);
      EXPECT_EQ(read[i].submitted, events[i].submitted);
      EXPECT_EQ(read[i].note, events[i].note);
      EXPECT_EQ(read[i].content.index(), events[i].content.index());
    }
  }
}

TEST(EventBlocks, EveryFlippedByteIsNoticed) {
  RandomFrames random(4);
  EventBlockHeader header;
  const Bytes bytes = encode_event_block(header, block_of(random_events(random, 20)));
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    Bytes flipped = bytes;
    flipped[at] ^= 0x10;
    std::vector<Event> events;
    EXPECT_FALSE(decode_event_block(flipped, events).ok()) << at;
    EXPECT_TRUE(events.empty());
    EXPECT_FALSE(decode_event_block(ByteSpan(bytes).first(at), events).ok());
  }
}

class EventLog : public ::testing::Test {
 protected:
  void open(EventLimits limits = {}) {
    writer_ = std::make_unique<EventWriter>(limits);
    ASSERT_TRUE(writer_->open(*engine_->snapshot(), last_).ok());
  }
  void SetUp() override { open(); }

  // An event of record `sequence` with a note of so many bytes.
  void record(std::uint64_t sequence, std::size_t bytes = 20) {
    writer_->record({{sequence, 0}, {}, std::string(bytes, 'x'), ClosureRemovedEvent{{{1, 2}, 3}}});
    last_ = sequence;
  }
  void begin(std::int64_t now_us = kHour) {
    puts_.clear(), deletes_.clear();
    writer_->begin_commit(*engine_->snapshot(), last_, now_us, puts_, deletes_);
  }
  void commit(std::int64_t now_us = kHour) {
    begin(now_us);
    ASSERT_TRUE(engine_->commit(epoch_, last_, puts_, deletes_).ok());
    writer_->committed();
  }
  EventsRead read(EventPosition after = {}, std::size_t bytes = kAll) {
    return read_events(*engine_->snapshot(), after, bytes).or_throw();
  }
  std::vector<std::uint64_t> sequences(EventPosition after = {}) {
    std::vector<std::uint64_t> all;
    for (const Event& event : read(after).events) all.push_back(event.at.sequence);
    return all;
  }
  std::vector<std::string> block_keys() {
    std::vector<std::string> all;
    EXPECT_TRUE(engine_->snapshot()
                    ->scan(keys::all_events(),
                           [&](std::string_view key, ByteSpan) {
                             if (keys::events_of(key)) all.emplace_back(key);
                             return true;
                           })
                    .ok());
    return all;
  }
  void overwrite(const std::string& key, const Bytes& value) {
    const std::vector<Put> puts{{key, value}};
    ASSERT_TRUE(engine_->commit(epoch_, last_, puts, {}).ok());
  }
  void erase(const std::string& key) {
    const std::vector<std::string> deletes{key};
    ASSERT_TRUE(engine_->commit(epoch_, last_, {}, deletes).ok());
  }

  std::shared_ptr<Engine> engine_ = make_memory_engine();
  std::uint64_t epoch_ = engine_->acquire().or_throw();
  std::unique_ptr<EventWriter> writer_;
  std::uint64_t last_ = 0;
  std::vector<Put> puts_;
  std::vector<std::string> deletes_;
};

TEST_F(EventLog, OfNothingIsEmpty) {
  EXPECT_TRUE(read().events.empty());
  EXPECT_EQ(newest_event(*engine_->snapshot()).or_throw(), EventPosition());
  commit();
  EXPECT_TRUE(block_keys().empty()) << "a commit without events writes none";
  EXPECT_FALSE(engine_->snapshot()->get(keys::all_events()).or_throw());
}

TEST_F(EventLog, IsReadInPiecesOfAnySize) {
  for (std::uint64_t sequence = 1; sequence <= 60; ++sequence) {
    record(sequence, sequence * 100);
    if (sequence % 4 == 0) commit();
  }
  EXPECT_EQ(newest_event(*engine_->snapshot()).or_throw(), (EventPosition{60, 0}));
  for (const std::size_t bytes : {std::size_t{1}, std::size_t{5000}, kAll}) {
    EventPosition after;
    std::uint64_t next = 1;
    for (;;) {
      const EventsRead piece = read(after, bytes);
      EXPECT_FALSE(piece.gap);
      ASSERT_FALSE(piece.events.empty());
      for (const Event& event : piece.events) EXPECT_EQ(event.at.sequence, next++);
      after = piece.through;
      if (!piece.more) break;
    }
    EXPECT_EQ(next, 61u);
  }
  for (std::uint64_t after = 0; after <= 60; ++after) {
    const auto rest = sequences({after, 0});
    ASSERT_EQ(rest.size(), 60 - after);
    if (after < 60) {
      EXPECT_EQ(rest.front(), after + 1);
    }
  }
  EXPECT_TRUE(sequences({1000, 0}).empty());
}

TEST_F(EventLog, ALargeCommitIsCutIntoBlocks) {
  for (std::uint64_t sequence = 1; sequence <= 400; ++sequence) record(sequence, 1000);
  commit();
  EXPECT_GE(block_keys().size(), 400'000 / (kEventBlockBytes + 1100));
  EXPECT_LE(block_keys().size(), 400'000 / kEventBlockBytes + 1);
  EXPECT_EQ(sequences().size(), 400u);
  EXPECT_EQ(read({}, 1).events.size(), read({}, kEventBlockBytes).events.size()) << "a block at least";
}

TEST_F(EventLog, KeepsTheLastHour) {
  for (std::uint64_t minute = 1; minute <= 150; ++minute) {
    record(minute);
    commit(kHour + static_cast<std::int64_t>(minute) * 60'000'000);
    EXPECT_LE(block_keys().size(), 61u);
  }
  EXPECT_EQ(sequences().front(), 90u);
  EXPECT_TRUE(read({88, 0}).gap) << "89 is no longer there";
  EXPECT_EQ(sequences({88, 0}).front(), 90u);
  EXPECT_FALSE(read({89, 0}).gap);
  EXPECT_FALSE(read().gap) << "{} is before all events";
  record(151);
  commit(10 * kHour);
  EXPECT_LE(deletes_.size(), 10u) << "not all at once";
  for (std::uint64_t more = 152; more <= 160; ++more) {
    record(more);
    commit(10 * kHour);
  }
  EXPECT_EQ(sequences().front(), 151u);
  EXPECT_TRUE(read({149, 0}).gap);
}

TEST_F(EventLog, KeepsWhatFits) {
  open({10'000, kHour});
  for (std::uint64_t sequence = 1; sequence <= 100; ++sequence) {
    record(sequence, 900);
    commit();
    EXPECT_LE(block_keys().size(), 11u);
  }
  EXPECT_EQ(sequences().back(), 100u);
  EXPECT_GE(sequences().size(), 9u);
  EXPECT_TRUE(read({1, 0}).gap);
  // A daemon that starts again with less room.
  open({3'000, kHour});
  record(101, 900);
  commit();
  record(102, 900);
  commit();
  EXPECT_EQ(sequences(), (std::vector<std::uint64_t>{100, 101, 102}));
  // A single commit that is larger than all is kept.
  for (std::uint64_t sequence = 103; sequence < 400; ++sequence) record(sequence, 900);
  commit();
  EXPECT_EQ(sequences().front(), 103u);
  EXPECT_EQ(sequences().size(), 297u);
}

TEST_F(EventLog, ReadsDoNotCrossWhatWasDeleted) {
  open({10'000, kHour});
  for (std::uint64_t sequence = 1; sequence <= 50; ++sequence) {
    record(sequence, 900);
    commit();
  }
  const auto head = decode_event_head(*engine_->snapshot()->get(keys::all_events()).or_throw()).or_throw();
  EXPECT_EQ(keys::events(head.oldest.sequence, head.oldest.ordinal), block_keys().front());
}

TEST_F(EventLog, AFailedCommitLosesNothing) {
  record(1);
  commit();
  writer_->note_moved({1, 5});
  writer_->record({{2, 0}, {}, {}, FrameAddedEvent{{1, 70}, 0, {}}});
  writer_->note_moved({1, 70});
  last_ = 2;
  begin();
  EXPECT_FALSE(puts_.empty());
  record(3);  // while it is being written
  writer_->note_moved({1, 6});
  writer_->note_moved({1, 70});
  const std::size_t later = writer_->memory_bytes();
  writer_->failed();
  EXPECT_GT(writer_->memory_bytes(), later);
  EXPECT_EQ(sequences(), std::vector<std::uint64_t>{1});
  commit();
  const EventsRead all = read();
  ASSERT_EQ(all.events.size(), 4u);
  EXPECT_EQ(all.events[1].at, (EventPosition{2, 0}));
  EXPECT_EQ(all.events[2].at, (EventPosition{3, 0}));
  EXPECT_EQ(all.events[3].at, (EventPosition{3, kMovedOrdinal}));
  EXPECT_EQ(std::get<FramesMovedEvent>(all.events[3].content).ranges, (std::vector<FrameRange>{{1, 5, 6}}))
      << "a frame that was added since did not move";
  EXPECT_EQ(writer_->memory_bytes(), 0u);
  writer_->note_moved({1, 70});
  record(4);
  commit();
  EXPECT_EQ(read({3, kMovedOrdinal}).events.size(), 2u) << "now it did";
}

TEST_F(EventLog, ACommitThatIsGivenUpLosesNothing) {
  record(1);
  begin();
  record(2);
  commit();
  EXPECT_EQ(sequences(), (std::vector<std::uint64_t>{1, 2}));
}

TEST_F(EventLog, DamageIsAGapOnce) {
  for (std::uint64_t sequence = 1; sequence <= 5; ++sequence) {
    record(sequence);
    commit();
  }
  const auto blocks = block_keys();
  overwrite(blocks[2], {1, 2, 3});
  const EventsRead before = read();
  EXPECT_FALSE(before.gap);
  EXPECT_TRUE(before.more);
  EXPECT_EQ(before.through, (EventPosition{2, 0}));
  const EventsRead after = read(before.through);
  EXPECT_TRUE(after.gap);
  EXPECT_FALSE(after.more);
  ASSERT_EQ(after.events.size(), 2u);
  EXPECT_EQ(after.events[0].at.sequence, 4u);
  EXPECT_FALSE(read({3, 0}).gap) << "who has read it needs it no more";

  erase(blocks[3]);
  EXPECT_TRUE(read({2, 0}).gap);
  EXPECT_EQ(sequences({2, 0}), std::vector<std::uint64_t>{5});
  overwrite(blocks[4], {});
  const EventsRead end = read({4, 0});
  EXPECT_TRUE(end.gap);
  EXPECT_TRUE(end.events.empty());
  EXPECT_EQ(end.through, (EventPosition{5, 0})) << "and goes on behind it";
  erase(blocks[4]);
  EXPECT_TRUE(read({4, 0}).gap);
  EXPECT_EQ(read({4, 0}).through, (EventPosition{5, 0}));
  record(6);
  commit();
  EXPECT_EQ(sequences({5, 0}), std::vector<std::uint64_t>{6});
  EXPECT_FALSE(read({5, 0}).gap);
}

TEST_F(EventLog, ALostHeadIsFoundAgain) {
  for (std::uint64_t sequence = 1; sequence <= 3; ++sequence) {
    record(sequence);
    commit();
  }
  const Bytes head = *engine_->snapshot()->get(keys::all_events()).or_throw();
  Bytes flipped = head;
  flipped.back() ^= 1;
  overwrite(std::string(keys::all_events()), flipped);
  EXPECT_EQ(read_events(*engine_->snapshot(), {}, kAll).reason(), Reason::DATA_LOSS);
  EXPECT_EQ(newest_event(*engine_->snapshot()).reason(), Reason::DATA_LOSS);
  open();
  record(4);
  commit();
  EXPECT_EQ(sequences(), (std::vector<std::uint64_t>{1, 2, 3, 4}));
  EXPECT_FALSE(read({1, 0}).gap);
}

// A map is served whatever is wrong with its log.
TEST_F(EventLog, ThatCannotBeReadBeginsAnew) {
  record(1);
  commit();
  class Unreadable final : public EngineSnapshot {
   public:
    std::uint64_t commit_number() const override { return 1; }
    Result<std::optional<Bytes>> get(std::string_view) const override { return Status(reason, ""); }
    Status scan_from(std::string_view, std::string_view, const Visit&) const override { return Status(reason, ""); }
    Reason reason = Reason::DATA_LOSS;
  } unreadable;
  writer_ = std::make_unique<EventWriter>(EventLimits());
  ASSERT_TRUE(writer_->open(unreadable, 1).ok());
  record(2);
  commit();
  EXPECT_TRUE(read({1, 0}).gap) << "what is not known to be there counts as lost";
  EXPECT_EQ(sequences({1, 0}), std::vector<std::uint64_t>{2});
  unreadable.reason = Reason::IO_ERROR;
  EXPECT_EQ(EventWriter({}).open(unreadable, 1).reason(), Reason::IO_ERROR);
}

}  // namespace
}  // namespace relmap::storage
