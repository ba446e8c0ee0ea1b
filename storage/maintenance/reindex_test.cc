#include "storage/maintenance/reindex.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <map>
#include <set>

#include "server/map/mapper.h"
#include "server/place/testing/random_vocabulary.h"
#include "storage/format/keys.h"
#include "storage/format/state_codec.h"
#include "storage/maintenance/testing/driven_map.h"
#include "storage/testing/fault_engine.h"
#include "storage/testing/forgetful_files.h"

namespace relmap::storage {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr std::uint32_t kFrames = 140, kFeatures = 4;
constexpr std::uint64_t kWithAppearance = kFrames - kFrames / 7;

bool has_appearance(std::uint32_t frame) { return frame % 7 != 6; }

WordFunction words_of(const std::shared_ptr<const place::Vocabulary>& vocabulary) {
  return [vocabulary](std::span<const AppearanceFeature> features) { return vocabulary->words(features); };
}

using Table = std::map<std::string, Bytes>;

// All that is stored, except the words and the map's state.
Table all_but_words(const EngineSnapshot& snapshot) {
  Table table;
  EXPECT_TRUE(snapshot
                  .scan("",
                        [&](std::string_view key, ByteSpan value) {
                          const auto part = keys::part_of(key);
                          if (key != keys::map_state() && !(part && part->part == Part::kWords))
                            table[std::string(key)] = Bytes(value.begin(), value.end());
                          return true;
                        })
                  .ok());
  return table;
}

MapState state_of(const EngineSnapshot& snapshot) {
  return decode_state(*snapshot.get(keys::map_state()).or_throw()).or_throw();
}

class ReindexTest : public ::testing::Test {
 protected:
  // A map of `former`'s words, in closed and open chunks; every seventh frame has no appearance, and the journal goes
  // on behind the last commit.
  void make_map(const std::shared_ptr<Engine>& engine) const {
    sim::PointsWorldOptions options;
    options.frames = kFrames + 1;
    options.appearance = kFeatures;
    const sim::PointsWorld world(options);
    const auto record = [&](std::uint32_t i) {
      Keyframe keyframe = world.keyframe(i);
      if (!has_appearance(i)) keyframe.appearance.clear();
      Bytes payload = encode_keyframe(keyframe);
      const std::uint32_t crc = crc32c(payload);
      return KeyframeRecord{map::kDriveSession, crc, std::move(payload)};
    };
    const std::uint64_t epoch = engine->acquire().or_throw();
    const auto map = Map::open(engine, epoch, std::make_shared<Budget>(std::size_t{256} << 20)).or_throw();
    map::MapBuilder builder(*map, words_of(former_), rba::RbaOptions{});
    const auto journal = [&](const JournalRecord& r) {
      const Bytes bytes = encode_record(r, engine->last_journal_sequence());
      return engine->append(epoch, {&bytes, 1}).or_throw();
    };
    const JournalRecord session = map::session_record(world);
    builder.apply(journal(session), session);
    for (std::uint32_t i = 0; i < kFrames; ++i) {
      const JournalRecord keyframe = record(i);
      builder.apply(journal(keyframe), keyframe);
    }
    map->state().vocabulary_crc = former_->crc();
    ASSERT_TRUE(map->commit().ok());
    journal(record(kFrames));
  }

  static Result<ReindexSummary> run(const std::shared_ptr<Engine>& engine,
                                    const std::shared_ptr<const place::Vocabulary>& vocabulary,
                                    const OnProgress& on_progress = {}, const OnFinding& on_finding = {}) {
    return reindex(engine, words_of(vocabulary), vocabulary->crc(), on_finding, on_progress);
  }

  // Frames whose words are not those that this vocabulary makes of their features.
  static std::set<std::uint32_t> frames_without_its_words(const std::shared_ptr<Engine>& engine,
                                                          const place::Vocabulary& vocabulary) {
    const auto view = open_map(engine)->view();
    std::set<std::uint32_t> others;
    for (std::uint32_t i = 0; i < kFrames; ++i) {
      const auto cold = view->cold({map::kDriveSession, i});
      EXPECT_EQ(cold->appearance.size(), has_appearance(i) ? kFeatures : 0);
      if (cold->words != vocabulary.words(cold->appearance)) others.insert(i);
    }
    return others;
  }

  const std::shared_ptr<const place::Vocabulary> former_ = place::random_vocabulary(300, 10, 1),
                                                 other_ = place::random_vocabulary(500, 10, 2);
};

TEST_F(ReindexTest, AllWordsAreOfTheOtherVocabularyAndNothingElseChanges) {
  const auto engine = make_memory_engine();
  make_map(engine);
  ASSERT_THAT(frames_without_its_words(engine, *former_), IsEmpty());
  ASSERT_EQ(frames_without_its_words(engine, *other_).size(), kWithAppearance);
  const Table before = all_but_words(*engine->snapshot());
  const MapState state = state_of(*engine->snapshot());
  const std::uint64_t journal = engine->last_journal_sequence();

  std::uint64_t told = 0;
  const auto done = run(engine, other_, [&](const MaintenanceProgress& progress) {
                      EXPECT_GE(progress.done, told);
                      EXPECT_EQ(progress.total, kFrames);
                      told = progress.done;
                      return true;
                    }).or_throw();
  EXPECT_TRUE(done.changed);
  EXPECT_EQ(done.frames, kFrames);
  EXPECT_EQ(done.with_words, kWithAppearance);
  EXPECT_EQ(done.without_appearance, kFrames - kWithAppearance);
  EXPECT_EQ(done.unreadable, 0u);
  EXPECT_EQ(done.former_crc, former_->crc());
  EXPECT_EQ(told, kWithAppearance);

  EXPECT_THAT(frames_without_its_words(engine, *other_), IsEmpty());
  EXPECT_EQ(all_but_words(*engine->snapshot()), before);
  MapState expected = state;
  expected.vocabulary_crc = other_->crc();
  expected.digests_commit = engine->snapshot()->commit_number();  // they are as right as before
  EXPECT_EQ(encode_state(state_of(*engine->snapshot())), encode_state(expected));
  EXPECT_EQ(engine->last_journal_sequence(), journal);
  EXPECT_EQ(engine->applied_sequence(), journal - 1);
  EXPECT_THAT(verified(*engine->snapshot()).findings, IsEmpty());
}

TEST_F(ReindexTest, WhatTheJournalStillHoldsGetsItsWordsWhenItIsApplied) {
  const auto engine = make_memory_engine();
  make_map(engine);
  ASSERT_TRUE(run(engine, other_).ok());
  const auto budget = std::make_shared<Budget>(std::size_t{256} << 20);
  EXPECT_EQ(map::Mapper::open(engine, budget, former_, {}).reason(), Reason::WRONG_VOCABULARY);
  const auto mapper = map::Mapper::open(engine, budget, other_, {}).or_throw();
  ASSERT_TRUE(mapper->wait_idle(std::chrono::steady_clock::now() + std::chrono::seconds(60)).ok());
  const auto last = mapper->view()->cold({map::kDriveSession, kFrames});
  ASSERT_TRUE(last);
  EXPECT_EQ(last->words, other_->words(last->appearance));
  EXPECT_EQ(mapper->places().size(), kWithAppearance + 1);
}

TEST_F(ReindexTest, WordsOfTheSameVocabularyAreLeftAlone) {
  const auto engine = make_memory_engine();
  make_map(engine);
  ASSERT_TRUE(run(engine, other_).or_throw().changed);
  const std::uint64_t commit = engine->snapshot()->commit_number();
  EXPECT_FALSE(run(engine, other_).or_throw().changed);
  EXPECT_EQ(engine->snapshot()->commit_number(), commit);
}

TEST_F(ReindexTest, AMapWithoutFramesTakesAnyVocabulary) {
  const auto engine = make_memory_engine();
  EXPECT_FALSE(run(engine, other_).or_throw().changed);
  EXPECT_EQ(engine->snapshot()->commit_number(), 0u);
}

// Every commit is tried as the last before the power fails.
TEST_F(ReindexTest, InterruptedAfterAnyCommitAnotherRunEndsInTheSameMap) {
  std::set<std::uint32_t> seen;
  for (int commits = 0;; ++commits) {
    const auto files = ForgetfulFiles::create(static_cast<std::uint64_t>(commits) + 1);
    const auto faults = std::make_shared<Faults>();
    make_map(open_fault_engine(files).or_throw());
    Table before;
    {
      const auto engine = open_fault_engine(files, faults).or_throw();
      before = all_but_words(*engine->snapshot());
      int chunks = 0;
      if (commits == 0) faults->commits = 1;
      const auto done = run(engine, other_, [&](const MaintenanceProgress&) {
        if (++chunks == commits) faults->commits = 1;
        return true;
      });
      if (done.ok()) {
        EXPECT_EQ(seen, (std::set<std::uint32_t>{0, former_->crc()})) << "of the map that a commit was missing to";
        EXPECT_GT(commits, 3);
        return;
      }
      EXPECT_EQ(done.reason(), Reason::IO_ERROR);
      files->restart();
    }
    const auto engine = open_fault_engine(files).or_throw();
    seen.insert(state_of(*engine->snapshot()).vocabulary_crc);
    EXPECT_EQ(all_but_words(*engine->snapshot()), before);
    EXPECT_THAT(verified(*engine->snapshot()).findings, IsEmpty());
    // Words of the two may stand side by side only where the map says that they are of neither.
    if (state_of(*engine->snapshot()).vocabulary_crc == former_->crc()) {
      EXPECT_THAT(frames_without_its_words(engine, *former_), IsEmpty());
    }

    EXPECT_EQ(run(engine, other_).or_throw().with_words, kWithAppearance);
    EXPECT_THAT(frames_without_its_words(engine, *other_), IsEmpty());
    EXPECT_EQ(state_of(*engine->snapshot()).vocabulary_crc, other_->crc());
    EXPECT_EQ(all_but_words(*engine->snapshot()), before);
  }
}

TEST_F(ReindexTest, StoppedHalfWayItGoesBackToTheFormerVocabularyToo) {
  const auto engine = make_memory_engine();
  make_map(engine);
  const auto stopped = run(engine, other_, [](const MaintenanceProgress&) { return false; });
  EXPECT_EQ(stopped.reason(), Reason::SHUTTING_DOWN);
  EXPECT_EQ(state_of(*engine->snapshot()).vocabulary_crc, 0u);
  EXPECT_FALSE(frames_without_its_words(engine, *former_).empty());
  for (const auto& vocabulary : {former_, other_}) {
    const auto opened = map::Mapper::open(engine, std::make_shared<Budget>(std::size_t{256} << 20), vocabulary, {});
    EXPECT_EQ(opened.reason(), Reason::WRONG_VOCABULARY);
    EXPECT_THAT(opened.status().message(), HasSubstr("a reindex was interrupted"));
  }
  EXPECT_EQ(run(engine, former_).or_throw().former_crc, 0u);
  EXPECT_THAT(frames_without_its_words(engine, *former_), IsEmpty());
}

TEST_F(ReindexTest, AFrameWhoseFeaturesAreDamagedLosesItsWordsAlone) {
  const auto engine = make_memory_engine();
  make_map(engine);
  constexpr FrameId kDamaged{map::kDriveSession, 100};
  const std::string key = keys::frame(Part::kCold, kDamaged);
  Bytes value = *engine->snapshot()->get(key).or_throw();
  value.back() ^= 0x10;
  const std::vector<Put> puts{{key, value}};
  ASSERT_TRUE(engine->commit(engine->acquire().or_throw(), engine->applied_sequence(), puts, {}).ok());

  std::vector<Finding> findings;
  const auto done = run(engine, other_, {}, [&](const Finding& finding) { findings.push_back(finding); }).or_throw();
  EXPECT_EQ(done.unreadable, 1u);
  EXPECT_EQ(done.with_words, kWithAppearance - 1);
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings.front().frame, kDamaged);
  EXPECT_EQ(findings.front().reason, Reason::DATA_LOSS);
  EXPECT_FALSE(engine->snapshot()->get(keys::frame(Part::kWords, kDamaged)).or_throw())
      << "words of the former vocabulary are left";
}

TEST_F(ReindexTest, AMapWhoseStateIsDamagedIsNotTouched) {
  const auto engine = make_memory_engine();
  make_map(engine);
  const std::vector<Put> puts{{keys::map_state(), Bytes(40, 1)}};
  ASSERT_TRUE(engine->commit(engine->acquire().or_throw(), engine->applied_sequence(), puts, {}).ok());
  const std::uint64_t commit = engine->snapshot()->commit_number();
  EXPECT_EQ(run(engine, other_).reason(), Reason::DATA_LOSS);
  EXPECT_EQ(engine->snapshot()->commit_number(), commit);
}

}  // namespace
}  // namespace relmap::storage
