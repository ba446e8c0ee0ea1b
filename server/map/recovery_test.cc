#include "server/map/recovery.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include "server/map/testing/points_drive.h"
#include "storage/engine/memory_engine.h"
#include "storage/map/map.h"
#include "storage/testing/forwarding_engine.h"
#include "storage/testing/partial_graph.h"

namespace relmap::map {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr std::uint64_t kFirstKeyframe = 2;  // record 1 begins the session

sim::PointsWorldOptions short_drive() {
  sim::PointsWorldOptions options;
  options.frames = 6;
  options.frames_per_lap = 60;
  return options;
}

// Hands out the journal of another engine with one record cut off, or ends with an error before a record.
class AlteredJournal final : public storage::ForwardingEngine {
 public:
  explicit AlteredJournal(std::shared_ptr<storage::Engine> to) : ForwardingEngine(std::move(to)) {}

  Status read_journal(std::uint64_t from, const std::function<bool(std::uint64_t, ByteSpan)>& visit) const override {
    bool unreadable = false;
    const Status read = engine().read_journal(from, [&](std::uint64_t sequence, ByteSpan record) {
      unreadable = sequence == unreadable_;
      return !unreadable && visit(sequence, sequence == cut_off_ ? record.first(record.size() / 2) : record);
    });
    return unreadable ? Status(Reason::IO_ERROR, "a bad sector") : read;
  }

  std::uint64_t cut_off_ = 0, unreadable_ = 0;  // sequences; 0: none
};

FrameId frame(std::uint32_t i) { return {kDriveSession, i}; }

// A journal of a session with six keyframes, of which nothing was committed.
class RecoveryTest : public ::testing::Test {
 protected:
  RecoveryTest() {
    append(session_record(world_));
    for (std::uint32_t i = 0; i < world_.size(); ++i) append(keyframe_record(world_, i));
  }
  void append(const storage::JournalRecord& record) {
    const Bytes bytes = storage::encode_record(record, 0);
    engine_->append(epoch_, std::span(&bytes, 1)).or_throw();
  }
  std::uint64_t last() const { return engine_->last_journal_sequence(); }

  // Opens the map as it was committed and re-applies the journal. Words of a keyframe are computed by words_.
  Replayed replay_all(std::uint64_t from = 1) {
    builder_.reset();
    map_ = storage::Map::open(engine_, epoch_, budget_).or_throw();
    builder_.emplace(
        *map_, [this](std::span<const AppearanceFeature> features) { return words_(features); }, rba::RbaOptions{});
    return replay(*engine_, from, *builder_);
  }
  std::uint64_t published_through() const { return map_->view()->state().applied_sequence; }

  const sim::PointsWorld world_{short_drive()};
  const std::shared_ptr<AlteredJournal> engine_ = std::make_shared<AlteredJournal>(storage::make_memory_engine());
  const std::uint64_t epoch_ = engine_->acquire().or_throw();
  const std::shared_ptr<storage::Budget> budget_ = std::make_shared<storage::Budget>(std::size_t{256} << 20);
  storage::WordFunction words_ = [](std::span<const AppearanceFeature>) { return std::vector<std::uint32_t>{}; };
  std::unique_ptr<storage::Map> map_;
  std::optional<MapBuilder> builder_;
};

TEST_F(RecoveryTest, EveryRecordIsAppliedInOrder) {
  const Replayed replayed = replay_all();
  EXPECT_TRUE(replayed.trouble.ok()) << replayed.trouble.to_string();
  EXPECT_THAT(replayed.frames, ElementsAre(frame(0), frame(1), frame(2), frame(3), frame(4), frame(5)));
  EXPECT_EQ(published_through(), last());
  PointsDrive drive;
  drive.drive(world_, world_.size(), {});
  EXPECT_EQ(storage::hash_map(*map_->view()), storage::hash_map(*drive.map().view())) << "the map that was lost";
}

TEST_F(RecoveryTest, OnlyRecordsAfterTheCommitAreApplied) {
  replay_all();
  ASSERT_TRUE(map_->commit().ok());
  append(storage::SetLabelRecord{frame(3), "dock", true});
  const Replayed replayed = replay_all(last());
  EXPECT_TRUE(replayed.trouble.ok()) << replayed.trouble.to_string();
  EXPECT_THAT(replayed.frames, IsEmpty());
  EXPECT_EQ(map_->view()->sessions().at(0).frames, 6u);
  EXPECT_THAT(map_->view()->hot(frame(3))->labels, ElementsAre("dock"));
}

TEST_F(RecoveryTest, AnEmptyJournalChangesNothing) {
  const Replayed replayed = replay_all(last() + 1);
  EXPECT_TRUE(replayed.trouble.ok());
  EXPECT_THAT(replayed.frames, IsEmpty());
  EXPECT_TRUE(replayed.looked_up) << "there is no frame whose lookup could be missing";
  EXPECT_EQ(published_through(), 0u);
}

TEST_F(RecoveryTest, TheLastFrameMayLackItsLookupOnlyIfNoRecordFollowsIt) {
  EXPECT_FALSE(replay_all().looked_up);
  append(storage::SetLabelRecord{frame(0), "dock", true});
  EXPECT_TRUE(replay_all().looked_up);
  append(keyframe_record(world_, 5));
  EXPECT_TRUE(replay_all().looked_up) << "a keyframe that was taken in before adds no frame";
}

TEST_F(RecoveryTest, ADamagedRecordEndsTheReplayAndIsNamed) {
  engine_->cut_off_ = kFirstKeyframe + 2;
  const Replayed replayed = replay_all();
  EXPECT_EQ(replayed.trouble.reason(), Reason::DATA_LOSS);
  EXPECT_THAT(replayed.trouble.message(), HasSubstr("journal record 4: "));
  EXPECT_THAT(replayed.frames, ElementsAre(frame(0), frame(1))) << "records behind the damage would not fit";
  EXPECT_EQ(published_through(), kFirstKeyframe + 1);
  EXPECT_FALSE(map_->view()->hot(frame(2)));
}

TEST_F(RecoveryTest, AnErrorOfTheEngineIsPassedOn) {
  engine_->unreadable_ = kFirstKeyframe + 3;
  const Replayed replayed = replay_all();
  EXPECT_EQ(replayed.trouble.to_string(), "IO_ERROR: a bad sector");
  EXPECT_THAT(replayed.frames, ElementsAre(frame(0), frame(1), frame(2)));
  EXPECT_EQ(published_through(), kFirstKeyframe + 2);
}

// As when a part of the map that the record needs cannot be read.
TEST_F(RecoveryTest, ARecordThatFailsEndsTheReplayWithItsStatus) {
  int keyframes = 0;
  words_ = [&](std::span<const AppearanceFeature>) -> std::vector<std::uint32_t> {
    if (++keyframes == 3) throw StatusError({Reason::DATA_LOSS, "a damaged part"});
    return {};
  };
  const Replayed replayed = replay_all();
  EXPECT_EQ(replayed.trouble.to_string(), "DATA_LOSS: a damaged part");
  EXPECT_EQ(keyframes, 3) << "no record was applied after it";
  EXPECT_THAT(replayed.frames, ElementsAre(frame(0), frame(1)));
  EXPECT_EQ(published_through(), kFirstKeyframe + 1) << "what may be half applied is not published";
}

TEST_F(RecoveryTest, ARecordThatThrowsAnythingElseEndsTheReplayAsAnInternalError) {
  int keyframes = 0;
  words_ = [&](std::span<const AppearanceFeature>) -> std::vector<std::uint32_t> {
    if (++keyframes == 2) throw std::runtime_error("out of range");
    return {};
  };
  const Replayed replayed = replay_all();
  EXPECT_EQ(replayed.trouble.to_string(), "INTERNAL: out of range");
  EXPECT_THAT(replayed.frames, ElementsAre(frame(0)));
  EXPECT_EQ(published_through(), kFirstKeyframe);
}

// A daemon that another one has replaced reads the journal until it ends. Its records are not lost to the new owner.
TEST_F(RecoveryTest, AnOwnerWhoseEpochHasExpiredReplaysButCannotCommit) {
  const std::uint64_t newer = engine_->acquire().or_throw();
  EXPECT_TRUE(replay_all().trouble.ok());
  EXPECT_EQ(published_through(), last());
  EXPECT_EQ(map_->commit().reason(), Reason::STALE_OWNER);
  const auto of_newer_owner = storage::Map::open(engine_, newer, budget_).or_throw();
  MapBuilder builder(*of_newer_owner, {}, rba::RbaOptions{});
  EXPECT_EQ(replay(*engine_, of_newer_owner->state().applied_sequence + 1, builder).frames.size(), 6u);
}

// Frames of two sessions that drove at once: the map took in the older frame of session 2 last.
class InTurns final : public storage::PartialGraph {
 public:
  std::shared_ptr<const storage::FrameHot> hot(FrameId id) const override {
    auto hot = std::make_shared<storage::FrameHot>();
    hot->present = true;
    hot->journal_sequence = id == kOther ? 10 : id.index;
    return hot;
  }
  static constexpr FrameId kOther{kDriveSession + 1, 0};
};

TEST(OpenLookups, OpenFramesAndThoseOfTheJournalAreLookedUpInTheOrderInWhichTheyWereTakenIn) {
  LookupQueue lookups(std::make_shared<storage::Budget>(std::size_t{1} << 20));
  find_open_lookups(InTurns(), {InTurns::kOther, frame(1), frame(2)},
                    {.frames = {frame(2), frame(3)}, .looked_up = true, .trouble = {}}, false, lookups);
  std::vector<FrameId> looked_up;
  std::promise<void> fourth;
  lookups.start(
      1,
      [&](FrameId id, const LaterFrames&) {
        looked_up.push_back(id);
        if (looked_up.size() == 4) fourth.set_value();
        return std::vector<storage::JournalRecord>{};
      },
      [](const storage::JournalRecord&, const LookupQueue::Durable&) { return true; }, [] {});
  EXPECT_EQ(fourth.get_future().wait_for(std::chrono::minutes(10)), std::future_status::ready);
  lookups.stop();
  EXPECT_THAT(looked_up, ElementsAre(frame(1), frame(2), frame(3), InTurns::kOther)) << "each once";
}

TEST(OpenLookups, InDeterministicModeOnlyTheLastFrameOfTheJournalMayLackItsLookup) {
  LookupQueue lookups(std::make_shared<storage::Budget>(std::size_t{1} << 20));
  find_open_lookups(InTurns(), {}, {.frames = {frame(2), frame(3)}, .looked_up = true, .trouble = {}}, true, lookups);
  EXPECT_THAT(lookups.open_frames(), IsEmpty());
  find_open_lookups(InTurns(), {frame(1)}, {.frames = {frame(2), frame(3)}, .looked_up = false, .trouble = {}}, true,
                    lookups);
  EXPECT_THAT(lookups.open_frames(), ElementsAre(frame(1), frame(3)));
}

}  // namespace
}  // namespace relmap::map
