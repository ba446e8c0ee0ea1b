#include "storage/maintenance/stored_events.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "storage/events/event_log.h"
#include "storage/format/keys.h"
#include "storage/maintenance/testing/driven_map.h"
#include "storage/testing/event_follower.h"
#include "storage/testing/temporary_folder.h"

namespace relmap::storage {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr std::size_t kAll = std::size_t{1} << 30;

class StoredEvents : public ::testing::Test {
 protected:
  void SetUp() override {
    drive_map(engine_);
    ASSERT_TRUE(engine_->snapshot()
                    ->scan(keys::all_events(),
                           [this](std::string_view key, ByteSpan value) {
                             if (keys::events_of(key))
                               blocks_.push_back({std::string(key), {value.begin(), value.end()}});
                             return true;
                           })
                    .ok());
    ASSERT_GE(blocks_.size(), 4u);
  }
  void write(const std::vector<Put>& puts, const std::vector<std::string>& deletes = {}) {
    ASSERT_TRUE(
        engine_->commit(engine_->acquire().or_throw(), open_map(engine_)->state().applied_sequence, puts, deletes)
            .ok());
  }
  std::vector<std::string> findings() { return verified(*engine_->snapshot()).findings; }
  // Repairs, and expects a sound log afterwards.
  void repair_map() {
    const TemporaryFolder folder;
    const auto summary = repair(engine_, folder / "quarantine", {}, {}, {}).or_throw();
    EXPECT_TRUE(summary.changed);
    EXPECT_EQ(summary.remaining, 0u);
    EXPECT_THAT(findings(), IsEmpty());
  }
  EventPosition last_of(std::size_t block) const {
    return decode_event_block_header(blocks_[block].value).or_throw().last;
  }

  std::shared_ptr<Engine> engine_ = make_memory_engine();
  std::vector<Put> blocks_;
};

TEST_F(StoredEvents, OfASoundMapAreSound) {
  EXPECT_THAT(findings(), IsEmpty());
  EventFollower follower;
  follower.follow(*engine_->snapshot());
  EXPECT_EQ(follower.map().frames, ToldMap::of(*open_map(engine_)).frames);
}

TEST_F(StoredEvents, ADamagedBlockIsNamedAndDropped) {
  Bytes flipped = blocks_[1].value;
  flipped[flipped.size() / 2] ^= 4;
  write({{blocks_[1].key, flipped}});
  const auto found = findings();
  ASSERT_EQ(found.size(), 1u);
  EXPECT_THAT(found[0], HasSubstr("events up to " + std::to_string(last_of(1).sequence) + ":"));
  repair_map();
  EXPECT_TRUE(read_events(*engine_->snapshot(), last_of(0), kAll).or_throw().gap);
  EXPECT_FALSE(read_events(*engine_->snapshot(), last_of(1), kAll).or_throw().gap);
}

TEST_F(StoredEvents, BlocksThatCannotBeAreDropped) {
  write({{keys::events(1'000'000, 0), blocks_[2].value}, {keys::events(last_of(0).sequence, 7), blocks_[0].value}});
  EXPECT_EQ(findings().size(), 2u) << "one from the future, and one under another key";
  repair_map();
  EventFollower follower;
  follower.follow(*engine_->snapshot());
}

TEST_F(StoredEvents, TheHeadIsMadeAnew) {
  const std::string head(keys::all_events());
  const auto whole = decode_event_head(*engine_->snapshot()->get(head).or_throw()).or_throw();
  const std::vector<Bytes> damaged{{1, 2, 3}, encode_event_head({whole.oldest, last_of(1), whole.bytes_through})};
  for (const Bytes& bytes : damaged) {
    write({{head, bytes}});
    EXPECT_EQ(findings().size(), 1u);
    EXPECT_THAT(findings()[0], HasSubstr("head of the log of events"));
    repair_map();
    EXPECT_EQ(decode_event_head(*engine_->snapshot()->get(head).or_throw()).or_throw(), whole);
  }
  write({}, {head});
  EXPECT_EQ(findings().size(), 1u);
  repair_map();
  EXPECT_EQ(decode_event_head(*engine_->snapshot()->get(head).or_throw()).or_throw(), whole);
}

// Whoever has not read the block is told that something is missing, also when it was the last.
TEST_F(StoredEvents, TheLastBlockLostIsAGap) {
  write({{blocks_.back().key, {}}});
  repair_map();
  const EventPosition before = last_of(blocks_.size() - 2);
  const EventsRead read = read_events(*engine_->snapshot(), before, kAll).or_throw();
  EXPECT_TRUE(read.gap);
  EXPECT_EQ(read.through, last_of(blocks_.size() - 1));
}

}  // namespace
}  // namespace relmap::storage
