#include "storage/maintenance/repair.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <random>

#include "server/map/testing/one_eye.h"
#include "storage/format/keys.h"
#include "storage/graph/path_tree.h"
#include "storage/maintenance/testing/driven_map.h"
#include "storage/testing/temporary_folder.h"

namespace relmap::storage {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

using Table = std::map<std::string, Bytes>;

Table table_of(const EngineSnapshot& snapshot) {
  Table table;
  EXPECT_TRUE(snapshot
                  .scan("",
                        [&](std::string_view key, ByteSpan value) {
                          table[std::string(key)] = Bytes(value.begin(), value.end());
                          return true;
                        })
                  .ok());
  return table;
}

class RepairTest : public ::testing::Test {
 protected:
  void SetUp() override {
    engine = make_memory_engine();
    static const Table kSound = [&] {
      drive_map(engine);
      commits() = engine->snapshot()->commit_number();
      return table_of(*engine->snapshot());
    }();
    sound = kSound;
    std::vector<Put> puts;
    for (const auto& [key, value] : sound) puts.push_back({key, value});
    engine = make_memory_engine();
    const auto epoch = engine->acquire().or_throw();
    for (std::uint64_t n = 0; n < commits(); ++n) ASSERT_TRUE(engine->commit(epoch, 0, puts, {}).ok());
  }
  static std::uint64_t& commits() {
    static std::uint64_t number = 0;
    return number;
  }

  void put(const std::string& key, const Bytes& value) {
    const std::vector<Put> puts{{key, value}};
    ASSERT_TRUE(engine->commit(engine->acquire().or_throw(), engine->applied_sequence(), puts, {}).ok());
  }
  void flip(const std::string& key, std::size_t offset) {
    Bytes value = sound.at(key);
    value.at(offset) ^= 0x10;
    put(key, value);
  }
  void erase(const std::string& key) {
    ASSERT_TRUE(sound.contains(key));
    const std::vector<std::string> deletes{key};
    ASSERT_TRUE(engine->commit(engine->acquire().or_throw(), engine->applied_sequence(), {}, deletes).ok());
  }
  std::size_t quarantined() const {
    std::error_code none;
    std::size_t files = 0;
    for (auto it = std::filesystem::directory_iterator(folder / "quarantine", none); it != decltype(it)(); ++it)
      ++files;
    return files;
  }

  // What every repair must leave: a map that verify and the oracle find sound, and nothing to do for a second repair.
  RepairSummary repaired() {
    const auto first = repair(engine, folder / "quarantine", {}, {}, {}).or_throw();
    EXPECT_EQ(first.remaining, 0u);
    EXPECT_THAT(verified(*engine->snapshot()).findings, IsEmpty());
    EXPECT_THAT(map::derived_differences(*open_map(engine)->view()), IsEmpty());
    const Table after = table_of(*engine->snapshot());
    EXPECT_FALSE(repair(engine, folder / "quarantine", {}, {}, {}).or_throw().changed);
    EXPECT_EQ(table_of(*engine->snapshot()), after);
    return first;
  }
  // Frames of which a view can read all parts.
  std::size_t readable() {
    const auto view = open_map(engine)->view();
    std::size_t frames = 0;
    for (std::uint32_t i = 0; i < kDrivenFrames; ++i) try {
        frames += view->hot({1, i}) && view->warm({1, i}) && view->cold({1, i});
      } catch (const StatusError& error) {
        EXPECT_EQ(error.status().reason(), Reason::DATA_LOSS);
      }
    return frames;
  }

  TemporaryFolder folder;
  Table sound;
  std::shared_ptr<Engine> engine;
};

// Chunk 0 and 1 are closed, chunk 2 (frames 128 on) is open.
const ChunkId kClosed{1, 1};
constexpr FrameId kInClosed{1, 100}, kInOpen{1, 140};

TEST_F(RepairTest, ASoundMapIsLeftAsItIs) {
  const std::uint64_t commit = engine->snapshot()->commit_number();
  const auto summary = repair(engine, folder / "quarantine", {}, {}, {}).or_throw();
  EXPECT_FALSE(summary.changed);
  EXPECT_EQ(engine->snapshot()->commit_number(), commit);
  EXPECT_EQ(table_of(*engine->snapshot()), sound);
  EXPECT_EQ(quarantined(), 0u);
}

// What a later version writes: under keys of its own, and in the extensions of what is rewritten.
TEST_F(RepairTest, WhatALaterVersionWroteIsKept) {
  const Table later{{"x", {1}}, {"zone/1", {2}}, {"\xff\xff", {3}}};
  for (const auto& [key, value] : later) put(key, value);
  const Extensions unknown = {{1000, {1, 2, 3}}};
  {
    const auto map = open_map(engine);
    map->edit_hot(kInClosed).unknown = map->edit_hot(kInClosed).edges[0].unknown = unknown;
    map->edit_session(map::kDriveSession).unknown = map->state().unknown = unknown;
    --map->state().keyframes;
    ASSERT_TRUE(map->commit().ok());
  }
  sound = table_of(*engine->snapshot());
  const std::string key = keys::part(Part::kHot, kClosed);
  flip(key, sound.at(key).size() - 5);
  EXPECT_TRUE(repaired().changed);
  const Table after = table_of(*engine->snapshot());
  for (const auto& [name, value] : later) EXPECT_EQ(after.at(name), value);
  const auto map = open_map(engine);
  EXPECT_EQ(map->hot(kInClosed)->unknown, unknown);
  EXPECT_EQ(map->hot(kInClosed)->edges[0].unknown, unknown);
  EXPECT_EQ(map->session(map::kDriveSession)->unknown, unknown);
  EXPECT_EQ(map->state().unknown, unknown);
}

TEST_F(RepairTest, AMonoSessionIsSoundWithoutEdges) {
  sim::PointsWorldOptions options;
  options.appearance = kDrivenFeatures;
  const sim::PointsWorld world(options);
  const auto with_mono = make_memory_engine();
  map::PointsDrive drive(with_mono);
  drive.apply(SessionRecord{1, "one eye", map::with_one_eye(world.keyframe(0)).session});
  for (std::uint32_t i = 0; i < 100; ++i) {
    Bytes payload = encode_keyframe(map::with_one_eye(world.keyframe(i)));
    const std::uint32_t crc = crc32c(payload);
    drive.apply(KeyframeRecord{1, crc, std::move(payload)});
  }
  ASSERT_TRUE(drive.map().commit().ok());
  EXPECT_THAT(verified(*with_mono->snapshot()).findings, IsEmpty());
  EXPECT_FALSE(repair(with_mono, folder / "quarantine", {}, {}, {}).or_throw().changed);

  // The same where something had to be mended.
  const std::vector<std::string> deletes{keys::part(Part::kHot, ChunkId{1, 0})};
  ASSERT_TRUE(with_mono->commit(with_mono->acquire().or_throw(), with_mono->applied_sequence(), {}, deletes).ok());
  const auto mended = repair(with_mono, folder / "quarantine", {}, {}, {}).or_throw();
  EXPECT_THAT(mended.lost_frames, ElementsAre(FrameRange{1, 0, 63}));
  EXPECT_EQ(mended.bridges, 0u);
  EXPECT_THAT(verified(*with_mono->snapshot()).findings, IsEmpty());
}

TEST_F(RepairTest, AFlippedHotBodyCostsItsFrameAlone) {
  const std::string key = keys::part(Part::kHot, kClosed);
  flip(key, sound.at(key).size() - 5);  // in the body of the chunk's last frame, 1:127
  const Verified broken = verified(*engine->snapshot());
  EXPECT_TRUE(broken.names("hot part of frame 1:127")) << ::testing::PrintToString(broken.findings);
  EXPECT_GE(readable(), kDrivenFrames - kFramesPerChunk);

  const RepairSummary summary = repaired();
  EXPECT_THAT(summary.lost_frames, ElementsAre(FrameRange{1, 127, 127}));
  EXPECT_EQ(summary.bridges, 1u);
  EXPECT_EQ(readable(), kDrivenFrames - 1);
  EXPECT_EQ(quarantined(), 4u);  // the chunk as it was, and the frame's other parts
  const auto map = open_map(engine);
  const Edge& bridge = map->hot({1, 128})->edges.at(0);
  EXPECT_EQ(bridge.a, (FrameId{1, 126}));
  EXPECT_EQ(bridge.kind, EdgeKind::kPrior);
  EXPECT_EQ(bridge.reason, Reason::DATA_LOSS);
  EXPECT_TRUE(build_path_tree(*map, {1, 120}).find({1, 135}));
  const Session session = *map->session(1);
  std::vector<Skipped> skipped;
  map->visit_skipped(1, 0, [&](const Skipped& item) { return skipped.push_back(item), true; });
  EXPECT_THAT(skipped, ElementsAre(Skipped{127, 127, 0, false, Reason::DATA_LOSS}));
  EXPECT_EQ(session.given_up, 1u);
  EXPECT_EQ(session.frames, kDrivenFrames - 1);
}

TEST_F(RepairTest, UnreadableSkippedSequencesAreRecordedAsLost) {
  auto map = open_map(engine);
  map->skip(1, {kDrivenFrames, kDrivenFrames + 4, 7, true, Reason::TRUNCATED});
  map->skip(1, {kDrivenFrames + 5, kDrivenFrames + 9, 0, false, Reason::DROPPED_BY_ROBOT});
  map->state().gaps += 5;
  map->state().pending.insert({1, 100});
  ASSERT_TRUE(map->commit().ok());
  EXPECT_THAT(verified(*engine->snapshot()).findings, IsEmpty());
  sound = table_of(*engine->snapshot());
  flip(keys::skipped(1, kDrivenFrames + 4), 9);
  flip(keys::pending({1, 1}), 9);
  const Verified broken = verified(*engine->snapshot());
  EXPECT_TRUE(broken.names("skipped sequences of session 1"));
  EXPECT_TRUE(broken.names("missing, and not recorded as skipped"));
  EXPECT_TRUE(broken.names("frames that wait for relaxation in chunk 1:1"));
  const RepairSummary summary = repaired();
  EXPECT_THAT(summary.lost_frames, ElementsAre(FrameRange{1, kDrivenFrames, kDrivenFrames + 4}));
  EXPECT_EQ(quarantined(), 2u);
  map = open_map(engine);
  EXPECT_EQ(map->session(1)->given_up, 10u);
  EXPECT_EQ(map->session(1)->refused, 0u);
  EXPECT_EQ(map->state().pending.chunk({1, 1}), 0u);
}

TEST_F(RepairTest, AFlippedHeaderCostsTheChunk) {
  flip(keys::part(Part::kHot, kClosed), 20);
  EXPECT_TRUE(verified(*engine->snapshot()).names("hot part of chunk 1:1"));
  const RepairSummary summary = repaired();
  EXPECT_THAT(summary.lost_frames, ElementsAre(FrameRange{1, 64, 127}));
  EXPECT_GT(summary.dropped_observations, 0u);
  EXPECT_EQ(readable(), kDrivenFrames - kFramesPerChunk);
}

TEST_F(RepairTest, TheLastChunkLostLeavesTheOneBeforeOpen) {
  for (std::uint32_t i = 128; i < kDrivenFrames; ++i) flip(keys::frame(Part::kHot, {1, i}), 60);
  EXPECT_THAT(repaired().lost_frames, ElementsAre(FrameRange{1, 128, 149}));
  const auto map = open_map(engine);
  EXPECT_EQ(map->session(1)->last, 127u);
  EXPECT_EQ(map->session(1)->next_sequence, kDrivenFrames);
  // What is edited there now is what is read back.
  map->edit_hot({1, 127}).mean_error = 0.25f;
  ASSERT_TRUE(map->commit().ok());
  EXPECT_EQ(open_map(engine)->hot({1, 127})->mean_error, 0.25f);
}

TEST_F(RepairTest, LosingTheFirstFramesBeginsTheSessionLater) {
  flip(keys::part(Part::kHot, {1, 0}), 20);
  const RepairSummary summary = repaired();
  EXPECT_THAT(summary.lost_frames, ElementsAre(FrameRange{1, 0, 63}));
  EXPECT_GT(summary.quarantined_edges, 0u);
  EXPECT_GT(summary.dropped_claims, 0u);
  EXPECT_THAT(open_map(engine)->hot({1, 64})->edge({{1, 64}, 0}), ::testing::IsNull());
}

TEST_F(RepairTest, AllFramesLostLeaveTheSession) {
  for (const auto& [key, value] : sound)
    if (key[0] == 'h') erase(key);
  EXPECT_THAT(repaired().lost_frames, ElementsAre(FrameRange{1, 0, kDrivenFrames - 1}));
  EXPECT_EQ(open_map(engine)->session(1)->frames, 0u);
}

TEST_F(RepairTest, ALostWarmPartLeavesAFrameWithoutObservations) {
  flip(keys::frame(Part::kWarm, kInOpen), 70);
  EXPECT_TRUE(verified(*engine->snapshot()).names("warm part of frame 1:140"));
  const RepairSummary summary = repaired();
  EXPECT_EQ(summary.frames_without_observations, 1u);
  EXPECT_THAT(summary.lost_frames, IsEmpty());
  EXPECT_TRUE(open_map(engine)->warm(kInOpen)->observations.empty());
  EXPECT_EQ(readable(), kDrivenFrames);
}

TEST_F(RepairTest, ALostWarmChunkLeavesFramesWithoutObservations) {
  erase(keys::part(Part::kWarm, kClosed));
  EXPECT_TRUE(verified(*engine->snapshot()).names("warm part of frame 1:100: missing"));
  EXPECT_EQ(repaired().frames_without_observations, kFramesPerChunk);
  EXPECT_EQ(readable(), kDrivenFrames);
}

TEST_F(RepairTest, ALostColdPartLeavesAFrameWithoutAppearance) {
  flip(keys::frame(Part::kCold, kInClosed), 100);
  EXPECT_TRUE(verified(*engine->snapshot()).names("cold part of frame 1:100"));
  const RepairSummary summary = repaired();
  EXPECT_EQ(summary.frames_without_appearance, 1u);
  EXPECT_TRUE(open_map(engine)->cold(kInClosed)->appearance.empty());
  EXPECT_EQ(quarantined(), 1u);
}

TEST_F(RepairTest, LostWordsLeaveTheFeatures) {
  erase(keys::frame(Part::kWords, kInClosed));
  flip(keys::frame(Part::kWords, kInOpen), 40);
  EXPECT_TRUE(verified(*engine->snapshot()).names("words part of frame 1:100: missing"));
  EXPECT_EQ(repaired().frames_without_words, 2u);
  EXPECT_EQ(open_map(engine)->cold(kInClosed)->appearance.size(), kDrivenFeatures);
}

TEST_F(RepairTest, ARecordOfAnotherFrameCountsAsLost) {
  put(keys::frame(Part::kHot, kInOpen), sound.at(keys::frame(Part::kHot, {1, 141})));
  EXPECT_TRUE(verified(*engine->snapshot()).names("hot part of frame 1:140: the record is of another frame"));
  EXPECT_THAT(repaired().lost_frames, ElementsAre(FrameRange{1, 140, 140}));
}

TEST_F(RepairTest, PartsOfFramesThatDoNotExistAreDropped) {
  put(keys::frame(Part::kCold, {1, 149}), sound.at(keys::frame(Part::kCold, {1, 149})));
  erase(keys::frame(Part::kHot, {1, 149}));
  EXPECT_TRUE(verified(*engine->snapshot()).names("cold part of frame 1:149: there is no such frame"));
  EXPECT_THAT(repaired().lost_frames, ElementsAre(FrameRange{1, 149, 149}));
}

TEST_F(RepairTest, WithoutItsRecordASessionIsLost) {
  flip(keys::session(1), 30);
  EXPECT_TRUE(verified(*engine->snapshot()).names("record of session 1"));
  EXPECT_THAT(repaired().lost_sessions, ElementsAre(1u));
  EXPECT_TRUE(open_map(engine)->sessions().empty());
  EXPECT_GT(quarantined(), 2 * kDrivenFrames);  // every record is kept
}

TEST_F(RepairTest, WithoutItsStateTheMapCountsAnew) {
  flip(keys::map_state(), 30);
  EXPECT_TRUE(verified(*engine->snapshot()).names("the map's state"));
  EXPECT_TRUE(repaired().changed);
  EXPECT_EQ(open_map(engine)->state().keyframes, kDrivenFrames);
  EXPECT_GT(open_map(engine)->state().closures_accepted, 0u);
}

TEST_F(RepairTest, AnyFlippedBytesAreRepaired) {
  std::mt19937 rng(11);
  std::vector<std::string> keys;
  for (const auto& [key, value] : sound)
    if (!value.empty()) keys.push_back(key);
  for (int round = 0; round < 20; ++round) {
    SetUp();
    std::string where;
    for (int n = 1 + round % 3; n > 0; --n) {
      const std::string& key = keys[rng() % keys.size()];
      Bytes value = sound.at(key);
      const std::size_t at = rng() % value.size();
      where += " " + ::testing::PrintToString(key) + "@" + std::to_string(at);
      if (round % 5 == 4)
        value.resize(at);
      else
        value[at] ^= static_cast<std::uint8_t>(1u << (rng() % 8));
      put(key, value);
    }
    SCOPED_TRACE(where);
    EXPECT_FALSE(verified(*engine->snapshot()).findings.empty());
    EXPECT_TRUE(repaired().changed);
  }
}

TEST_F(RepairTest, WhatIsLostIsBridgedAndTheMapGoesOn) {
  flip(keys::part(Part::kHot, {1, 0}), sound.at(keys::part(Part::kHot, {1, 0})).size() - 3);
  (void)repaired();
  sim::PointsWorldOptions options;
  options.frames = kDrivenFrames + 20;
  options.frames_per_lap = kDrivenLap;
  options.appearance = kDrivenFeatures;
  const sim::PointsWorld world(options);
  map::PointsDrive drive(engine);
  for (std::uint32_t i = kDrivenFrames; i < options.frames; ++i) drive.apply(map::keyframe_record(world, i));
  ASSERT_TRUE(drive.map().commit().ok());
  EXPECT_EQ(drive.map().session(1)->frames, options.frames - 1);
  EXPECT_THAT(verified(*engine->snapshot()).findings, IsEmpty());
}

}  // namespace
}  // namespace relmap::storage
