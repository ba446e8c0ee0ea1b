#include "server/map/known_places.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <future>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "server/map/testing/points_drive.h"
#include "server/place/testing/random_vocabulary.h"
#include "storage/engine/memory_engine.h"
#include "storage/format/keys.h"

namespace relmap::map {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

// A map of a session of six frames with features, and an index that knows nothing yet.
class KnownPlacesTest : public ::testing::Test {
 protected:
  static constexpr std::uint32_t kDriven = 6;

  static sim::PointsWorldOptions described_drive() {
    sim::PointsWorldOptions options;
    options.frames = kDriven;
    options.frames_per_lap = 60;
    options.appearance = 60;
    return options;
  }
  static FrameId frame(std::uint32_t i) { return {kDriveSession, i}; }

  void append(const storage::JournalRecord& record) {
    const Bytes bytes = storage::encode_record(record, 0);
    engine_->append(epoch_, std::span(&bytes, 1)).or_throw();
  }
  // The words of a keyframe are computed by `words`.
  void drive(const storage::WordFunction& words) {
    const sim::PointsWorld world(described_drive());
    append(session_record(world));
    for (std::uint32_t i = 0; i < kDriven; ++i) append(keyframe_record(world, i));
    open_map();
    MapBuilder builder(*map_, words, rba::RbaOptions{});
    ASSERT_EQ(replay(*engine_, 1, builder).frames.size(), kDriven);
  }
  void open_map() {
    map_.reset();
    map_ = storage::Map::open(engine_, epoch_, budget_).or_throw();
  }
  Status index() { return index_known_places(*map_->view(), *vocabulary_, lookups_, places_, *budget_); }

  const std::shared_ptr<storage::Engine> engine_ = storage::make_memory_engine();
  const std::uint64_t epoch_ = engine_->acquire().or_throw();
  const std::shared_ptr<storage::Budget> budget_ = std::make_shared<storage::Budget>(std::size_t{256} << 20);
  const std::shared_ptr<const place::Vocabulary> vocabulary_ = place::random_vocabulary(300, 10, 1);
  const storage::WordFunction words_ = [this](std::span<const AppearanceFeature> features) {
    return vocabulary_->words(features);
  };
  std::unique_ptr<storage::Map> map_;
  place::PlaceIndex places_{vocabulary_};
  LookupQueue lookups_{budget_};
};

TEST_F(KnownPlacesTest, EveryFrameWithWordsBecomesAPlace) {
  drive(words_);
  EXPECT_TRUE(index().ok());
  EXPECT_EQ(places_.size(), kDriven);
  EXPECT_EQ(budget_->used(storage::Share::kPlaceIndex), places_.memory_bytes());
}

TEST_F(KnownPlacesTest, CommittedFramesBecomePlacesToo) {
  drive(words_);
  ASSERT_TRUE(map_->commit().ok());
  open_map();
  EXPECT_TRUE(index().ok());
  EXPECT_EQ(places_.size(), kDriven);
}

TEST_F(KnownPlacesTest, AFrameWhoseLookupIsOpenIsLeftToIt) {
  drive(words_);
  lookups_.open(frame(3));
  EXPECT_TRUE(index().ok());
  EXPECT_FALSE(places_.contains(frame(3)));
  EXPECT_EQ(places_.size(), kDriven - 1);
}

TEST_F(KnownPlacesTest, WordsThatARepairHasLostAreComputedFromTheFeatures) {
  drive({});
  ASSERT_TRUE(map_->commit().ok());
  open_map();
  const auto cold = map_->view()->cold(frame(0));
  ASSERT_TRUE(cold->words.empty() && !cold->appearance.empty());
  EXPECT_TRUE(index().ok());
  EXPECT_EQ(places_.size(), kDriven);
}

TEST_F(KnownPlacesTest, WordsThatCannotBeReadAreAnError) {
  drive(words_);
  ASSERT_TRUE(map_->commit().ok());
  const std::string key = storage::keys::frame(storage::Part::kWords, frame(2));
  Bytes damaged = *engine_->snapshot()->get(key).or_throw();
  damaged.back() ^= 0x10;
  const std::vector<storage::Put> puts{{key, damaged}};
  ASSERT_TRUE(engine_->commit(epoch_, engine_->applied_sequence(), puts, {}).ok());
  open_map();
  EXPECT_EQ(index().reason(), Reason::DATA_LOSS);
}

TEST_F(KnownPlacesTest, OpenFramesAndThoseOfTheJournalAreLookedUpByTheThread) {
  find_open_lookups({frame(1), frame(2)}, {.frames = {frame(2), frame(3)}, .looked_up = true, .trouble = {}}, false,
                    lookups_);
  std::vector<FrameId> looked_up;
  std::promise<void> third;
  lookups_.start(
      [&](FrameId id) {
        looked_up.push_back(id);
        if (looked_up.size() == 3) third.set_value();
        return std::vector<storage::JournalRecord>{};
      },
      [](const storage::JournalRecord&) { return true; }, [] {});
  EXPECT_EQ(third.get_future().wait_for(std::chrono::seconds(60)), std::future_status::ready);
  lookups_.stop();
  EXPECT_THAT(looked_up, ElementsAre(frame(1), frame(2), frame(3))) << "each once";
}

TEST_F(KnownPlacesTest, InDeterministicModeOnlyTheLastFrameOfTheJournalMayLackItsLookup) {
  find_open_lookups({}, {.frames = {frame(2), frame(3)}, .looked_up = true, .trouble = {}}, true, lookups_);
  EXPECT_THAT(lookups_.open_frames(), IsEmpty());
  find_open_lookups({frame(1)}, {.frames = {frame(2), frame(3)}, .looked_up = false, .trouble = {}}, true, lookups_);
  EXPECT_THAT(lookups_.open_frames(), ElementsAre(frame(1), frame(3)));
}

}  // namespace
}  // namespace relmap::map
