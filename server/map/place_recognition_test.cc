#include "server/map/place_recognition.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "server/map/recovery.h"
#include "server/map/testing/points_drive.h"
#include "server/place/testing/random_vocabulary.h"
#include "storage/engine/memory_engine.h"
#include "storage/format/keys.h"

namespace relmap::map {
namespace {

using ::testing::IsEmpty;

// A map of a session of six frames with features, none of which is a place yet.
class PlaceRecognitionTest : public ::testing::Test {
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
  Status load() { return recognition_.load(*map_->view()); }

  const std::shared_ptr<storage::Engine> engine_ = storage::make_memory_engine();
  const std::uint64_t epoch_ = engine_->acquire().or_throw();
  const std::shared_ptr<storage::Budget> budget_ = std::make_shared<storage::Budget>(std::size_t{256} << 20);
  const std::shared_ptr<const place::Vocabulary> vocabulary_ = place::random_vocabulary(300, 10, 1);
  const storage::WordFunction words_ = [this](std::span<const AppearanceFeature> features) {
    return vocabulary_->words(features);
  };
  std::unique_ptr<storage::Map> map_;
  PlaceRecognition recognition_{vocabulary_, budget_, "", 2};
  LookupQueue lookups_{budget_};
};

TEST_F(PlaceRecognitionTest, EveryFrameWithWordsBecomesAPlace) {
  drive(words_);
  EXPECT_TRUE(load().ok());
  EXPECT_EQ(recognition_.places().size(), kDriven);
  EXPECT_EQ(budget_->used(storage::Share::kPlaceIndex), recognition_.places().memory_bytes());
}

TEST_F(PlaceRecognitionTest, CommittedFramesBecomePlacesToo) {
  drive(words_);
  ASSERT_TRUE(map_->commit().ok());
  open_map();
  EXPECT_TRUE(load().ok());
  EXPECT_EQ(recognition_.places().size(), kDriven);
}

TEST_F(PlaceRecognitionTest, WordsThatARepairHasLostAreComputedFromTheFeatures) {
  drive({});
  ASSERT_TRUE(map_->commit().ok());
  open_map();
  const auto cold = map_->view()->cold(frame(0));
  ASSERT_TRUE(cold->words.empty() && !cold->appearance.empty());
  EXPECT_TRUE(load().ok());
  EXPECT_EQ(recognition_.places().size(), kDriven);
}

TEST_F(PlaceRecognitionTest, WordsThatCannotBeReadAreAnError) {
  drive(words_);
  ASSERT_TRUE(map_->commit().ok());
  const std::string key = storage::keys::frame(storage::Part::kWords, frame(2));
  Bytes damaged = *engine_->snapshot()->get(key).or_throw();
  damaged.back() ^= 0x10;
  const std::vector<storage::Put> puts{{key, damaged}};
  ASSERT_TRUE(engine_->commit(epoch_, engine_->applied_sequence(), puts, {}).ok());
  open_map();
  EXPECT_EQ(load().reason(), Reason::DATA_LOSS);
}

TEST_F(PlaceRecognitionTest, NothingIsFoundInAMapOfOneStretchOrForASessionThatIsBeingDeleted) {
  drive(words_);
  EXPECT_TRUE(load().ok());
  EXPECT_THAT(recognition_.look_up(*map_->view(), frame(5)), IsEmpty()) << "all others are its recent past";
  MapBuilder(*map_, words_, rba::RbaOptions{})
      .apply(map_->view()->state().applied_sequence + 1,
             storage::SetSessionStateRecord{kDriveSession, storage::SessionState::kDeleting});
  map_->publish();
  EXPECT_THAT(recognition_.look_up(*map_->view(), frame(5)), IsEmpty());
}

}  // namespace
}  // namespace relmap::map
