#include "storage/rocksdb/repair_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <random>

#include "storage/maintenance/testing/driven_map.h"
#include "storage/rocksdb/rocksdb_engine.h"
#include "storage/testing/temporary_folder.h"

namespace relmap::storage {
namespace {

namespace fs = std::filesystem;
using ::testing::IsEmpty;

constexpr std::uint32_t kApplied = 132, kFrames = 140;

WordFunction some_words() {
  return [](std::span<const AppearanceFeature> features) { return std::vector<std::uint32_t>(features.size(), 7); };
}
std::shared_ptr<Budget> budget() { return std::make_shared<Budget>(std::size_t{256} << 20); }

// A driven map on disk, in several tables and blob files, with the last records of its journal not applied yet. Made
// once; each test damages a copy.
void make_sound(const std::string& path) {
  sim::PointsWorldOptions world_options;
  world_options.frames = kFrames;
  world_options.frames_per_lap = kDrivenLap;
  world_options.appearance = 60;  // cold parts large enough for blob files
  const sim::PointsWorld world(world_options);
  RocksDbOptions options;
  options.cache_bytes = std::size_t{8} << 20;  // hence a memtable of 1 MiB
  const auto engine = open_rocksdb(path, options).or_throw();
  const std::uint64_t epoch = engine->acquire().or_throw();
  ASSERT_EQ(engine->allocate_session(epoch).or_throw(), map::kDriveSession);
  const auto map = Map::open(engine, epoch, budget()).or_throw();
  map::MapBuilder builder(*map, some_words(), {});
  const auto take = [&](const JournalRecord& record, bool apply) {
    const Bytes bytes = encode_record(record, engine->last_journal_sequence());
    const auto sequence = engine->append(epoch, {&bytes, 1}).or_throw();
    if (apply) builder.apply(sequence, record);
  };
  take(map::session_record(world), true);
  for (std::uint32_t i = 0; i < kFrames; ++i) {
    take(map::keyframe_record(world, i), i < kApplied);
    if (i % 3 == 0 && i < kApplied)
      if (auto proposal = map::true_closure(*map, world, i, kDrivenLap)) take(*proposal, true);
    if (i % 11 == 10 && i < kApplied) {
      ASSERT_TRUE(map->commit().ok());
    }
    if (i == 110) {  // what is committed so far stands in tables and blobs, the rest in RocksDB's log
      ASSERT_TRUE(engine->compact([](std::uint64_t, std::uint64_t) { return Status(); }).ok());
    }
  }
}

class RepairFolder : public ::testing::Test {
 protected:
  void SetUp() override {
    static const TemporaryFolder kSound;
    if (!fs::exists(kSound / "data")) make_sound(kSound / "data");
    fs::remove_all(data);
    fs::copy(kSound / "data", data, fs::copy_options::recursive);
  }

  std::vector<fs::path> files(const std::string& where, const std::string& part) const {
    std::vector<fs::path> found;
    for (const auto& entry : fs::directory_iterator(data + where))
      if (entry.path().filename().string().find(part) != std::string::npos && entry.is_regular_file())
        found.push_back(entry.path());
    std::sort(found.begin(), found.end());
    return found;
  }
  static void flip(const fs::path& path, std::uint64_t offset) {
    std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
    file.seekg(static_cast<std::streamoff>(offset));
    const int byte = file.get();
    file.seekp(static_cast<std::streamoff>(offset));
    file.put(static_cast<char>(byte ^ 0x20));
  }
  // Every file that repair could change, with its bytes.
  std::map<std::string, std::string> contents() const {
    std::map<std::string, std::string> all;
    for (const auto& entry : fs::recursive_directory_iterator(data)) {
      const std::string name = entry.path().filename();
      if (!entry.is_regular_file() || name.starts_with("LOG") || name == "LOCK") continue;
      std::ifstream in(entry.path(), std::ios::binary);
      all[entry.path()] = {std::istreambuf_iterator<char>(in), {}};
    }
    return all;
  }

  // Repairs. Whatever was damaged, the map then opens, takes in the rest of its journal, and is sound.
  RepairSummary repaired() {
    std::vector<std::string> told;
    auto result = repair_folder(data, {}, [&](const Finding& finding) { told.push_back(finding.what); }, {});
    if (!result.ok()) {
      ADD_FAILURE() << result.status().to_string();
      return {};
    }
    EXPECT_EQ(result->remaining, 0u) << ::testing::PrintToString(told);
    EXPECT_EQ(result->changed, !told.empty());
    EXPECT_FALSE(fs::exists(data + "/salvage"));
    frames_after = replayed();
    auto again = repair_folder(data, {}, {}, {});
    EXPECT_TRUE(again.ok()) << again.status().to_string();
    EXPECT_FALSE(again.ok() && again->changed);
    return *std::move(result);
  }
  // Applies the journal as the daemon would at its start, and returns the number of frames then.
  std::uint32_t replayed() {
    const auto engine = open_rocksdb(data);
    if (!engine.ok()) {
      ADD_FAILURE() << engine.status().to_string();
      return 0;
    }
    const auto map = Map::open(*engine, (*engine)->acquire().or_throw(), budget()).or_throw();
    map::MapBuilder builder(*map, some_words(), {});
    const Status read =
        (*engine)->read_journal(map->state().applied_sequence + 1, [&](std::uint64_t sequence, ByteSpan bytes) {
          builder.apply(sequence, decode_record(bytes).or_throw().record);
          return true;
        });
    EXPECT_TRUE(read.ok()) << read.to_string();
    EXPECT_TRUE(map->commit().ok());
    EXPECT_THAT(verified(*(*engine)->snapshot()).findings, IsEmpty());
    const auto session = map->session(map::kDriveSession);
    if (!session) return 0;
    EXPECT_EQ(session->next_sequence, next_after);  // no robot is stuck
    return session->frames;
  }
  // What an operator sees before the repair: an open that fails by name, or findings; never a crash.
  void look() {
    RocksDbOptions options;
    options.read_only = true;
    const auto engine = open_rocksdb(data, options);
    if (!engine.ok()) return;
    (void)verify(*(*engine)->snapshot(), {}, {}, {});
    (void)verify_journal(**engine, {}, {});
  }

  TemporaryFolder folder;
  const std::string data = folder / "data";
  std::uint32_t frames_after = 0, next_after = kFrames;
};

TEST_F(RepairFolder, ASoundFolderIsLeftByteForByte) {
  const auto before = contents();
  const auto summary = repair_folder(data, {}, {}, {}).or_throw();
  EXPECT_FALSE(summary.changed);
  EXPECT_EQ(contents(), before);
  EXPECT_EQ(replayed(), kFrames);
}

// What a later version writes survives the salvage of a store; what described the map as it was does not.
TEST_F(RepairFolder, KeysOfALaterVersionAreSaved) {
  const std::vector<Put> later{{"x", {1}}, {"zone/1", {2}}, {"\xff\xff", {3}}};
  {
    const auto engine = open_rocksdb(data).or_throw();
    ASSERT_TRUE(engine->commit(engine->acquire().or_throw(), engine->applied_sequence(), later, {}).ok());
  }
  std::ofstream(data + "/HASH") << "of before\n";
  for (const fs::path& manifest : files("/map", "MANIFEST")) fs::resize_file(manifest, fs::file_size(manifest) / 2);
  EXPECT_TRUE(repaired().salvaged);
  EXPECT_EQ(frames_after, kFrames);
  EXPECT_FALSE(fs::exists(data + "/HASH"));
  const auto engine = open_rocksdb(data).or_throw();
  for (const Put& put : later) EXPECT_EQ(engine->snapshot()->get(put.key).or_throw(), put.value) << put.key;
}

TEST_F(RepairFolder, AFolderInUseIsLeftAlone) {
  const auto owner = open_rocksdb(data).or_throw();
  EXPECT_EQ(repair_folder(data, {}, {}, {}).reason(), Reason::FOLDER_LOCKED);
}

TEST_F(RepairFolder, AFolderWithoutAMapIsNoMap) {
  fs::create_directory(folder / "nothing");
  EXPECT_EQ(repair_folder(folder / "nothing", {}, {}, {}).reason(), Reason::NO_SUCH_FILE);
}

struct FileDamage {
  std::string name, folder, part;
};
void PrintTo(const FileDamage& damage, std::ostream* out) { *out << damage.name; }

const std::vector<FileDamage> kFiles = {
    {"Table", "/map", ".sst"},        {"Blob", "/map", ".blob"},      {"Log", "/map", ".log"},
    {"Manifest", "/map", "MANIFEST"}, {"Current", "/map", "CURRENT"}, {"Journal", "/journal", ".log"},
};

class RepairFile : public RepairFolder, public ::testing::WithParamInterface<FileDamage> {
 protected:
  void flip_some(std::uint64_t seed) {
    std::mt19937_64 rng(seed);
    const auto all = files(GetParam().folder, GetParam().part);
    ASSERT_FALSE(all.empty());
    const fs::path& path = all[rng() % all.size()];
    const std::uint64_t offset = rng() % fs::file_size(path);
    SCOPED_TRACE(path.filename().string() + "@" + std::to_string(offset));
    flip(path, offset);
    look();
    (void)repaired();
    EXPECT_GT(frames_after, 0u);
  }
};

TEST_P(RepairFile, WithAFlippedBit) {
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    SetUp();
    flip_some(seed);
  }
}

// When the end of a journal is gone, nothing says that there was more: robots send the last keyframes again.
TEST_P(RepairFile, Truncated) {
  if (GetParam().name == "Journal") next_after = kApplied;
  const auto all = files(GetParam().folder, GetParam().part);
  fs::resize_file(all.back(), fs::file_size(all.back()) / 2);
  look();
  (void)repaired();
  EXPECT_GT(frames_after, 0u);
}

TEST_P(RepairFile, Missing) {
  if (GetParam().name == "Journal") next_after = kApplied;
  const auto all = files(GetParam().folder, GetParam().part);
  fs::remove(all.front());
  look();
  (void)repaired();
  EXPECT_GT(frames_after, 0u);
}

INSTANTIATE_TEST_SUITE_P(Of, RepairFile, ::testing::ValuesIn(kFiles), [](const auto& file) { return file.param.name; });

class LongRepairFile : public RepairFile {};
TEST_P(LongRepairFile, WithAFlippedBit) {
  for (std::uint64_t seed = 100; seed < 140; ++seed) {
    SetUp();
    flip_some(seed);
  }
}
INSTANTIATE_TEST_SUITE_P(LongOf, LongRepairFile, ::testing::ValuesIn(kFiles),
                         [](const auto& file) { return file.param.name; });

TEST_F(RepairFolder, ALostListOfFilesIsMadeAnewWithTheBlobs) {
  for (const fs::path& path : files("/map", "MANIFEST")) fs::remove(path);
  fs::remove(data + "/map/CURRENT");
  EXPECT_EQ(open_rocksdb(data).reason(), Reason::DATA_LOSS);  // and not a new, empty store
  const auto summary = repaired();
  EXPECT_TRUE(summary.salvaged);
  EXPECT_THAT(summary.lost_frames, IsEmpty());
  EXPECT_EQ(summary.frames_without_appearance, 0u);
  EXPECT_EQ(frames_after, kFrames);
}

TEST_F(RepairFolder, ALostJournalRecordIsAGapAndWhatStandsBehindItGoesOn) {
  const auto segment = files("/journal", ".log").back();
  // In the payload of a keyframe that was not applied: the fourth record from the end or so.
  flip(segment, fs::file_size(segment) - 4 * (fs::file_size(segment) / (kFrames + 20)));
  EXPECT_EQ(open_rocksdb(data).or_throw()->read_journal(1, [](std::uint64_t, ByteSpan) { return true; }).reason(),
            Reason::DATA_LOSS);
  const auto summary = repaired();
  ASSERT_EQ(summary.lost_records.size(), 1u);
  EXPECT_EQ(summary.lost_records[0].first, summary.lost_records[0].last);
  EXPECT_EQ(frames_after, kFrames - 1);
  EXPECT_FALSE(summary.salvaged);
  EXPECT_TRUE(fs::is_directory(data + "/quarantine/journal"));
}

TEST_F(RepairFolder, AFolderWithoutItsFormatIsReadAsWhatItIs) {
  std::ofstream(data + "/FORMAT") << "\x01rubbish";
  EXPECT_TRUE(repaired().changed);
  EXPECT_EQ(frames_after, kFrames);
  std::ofstream(data + "/FORMAT") << "relmap map 999\n";
  EXPECT_EQ(repair_folder(data, {}, {}, {}).reason(), Reason::UNKNOWN_FORMAT_VERSION);
}

TEST_F(RepairFolder, WithoutItsStoreNothingCanBeSaved) {
  fs::remove_all(data + "/map");
  fs::rename(files("/journal", ".log").front(), data + "/journal/journal-00000000000000000090.log");
  const auto result = repair_folder(data, {}, {}, {});
  EXPECT_EQ(result.reason(), Reason::DATA_LOSS);
  EXPECT_NE(result.status().message().find("map is missing"), std::string::npos);
}

TEST_F(RepairFolder, AnInterruptedRepairIsFinishedByTheNext) {
  const fs::path blob = files("/map", ".blob").back();
  fs::resize_file(blob, fs::file_size(blob) / 2);
  // Stopped while the copy was being written.
  int calls = 0;
  EXPECT_EQ(repair_folder(data, {}, {}, [&](const MaintenanceProgress&) { return ++calls < 3; }).reason(),
            Reason::SHUTTING_DOWN);
  // Stopped after the exchange: what is left beside is the damaged store.
  fs::create_directories(data + "/salvage");
  fs::copy(data + "/map", data + "/salvage/map", fs::copy_options::recursive);
  (void)repaired();
  EXPECT_TRUE(fs::is_directory(data + "/quarantine/map"));
  EXPECT_TRUE(fs::is_directory(data + "/quarantine/map.2"));
  // Stopped between two renames, on a file system that cannot exchange: the store is beside, and complete.
  fs::create_directories(data + "/salvage");
  fs::rename(data + "/map", data + "/salvage/map");
  std::ofstream(data + "/salvage/map/COMPLETE");
  EXPECT_EQ(open_rocksdb(data).reason(), Reason::DATA_LOSS);  // and not a new, empty store
  ASSERT_TRUE(repair_folder(data, {}, {}, {}).ok());
  EXPECT_GT(replayed(), 0u);
}

}  // namespace
}  // namespace relmap::storage
