#include "storage/rocksdb/rocksdb_engine.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <set>
#include <thread>

#include "storage/journal/journal_record.h"
#include "storage/maintenance/verify.h"
#include "storage/map/map.h"
#include "storage/rocksdb/recorded_hash.h"
#include "storage/rocksdb/restore_folder.h"
#include "storage/testing/engine_conformance.h"
#include "storage/testing/random_frames.h"
#include "storage/testing/temporary_folder.h"

namespace relmap::storage {
namespace {

namespace fs = std::filesystem;

EngineStore rocksdb_store() {
  auto folder = std::make_shared<TemporaryFolder>();
  return {[folder] { return open_rocksdb(*folder / "data").value(); }, true};
}

Status patient(std::uint64_t, std::uint64_t) { return {}; }

INSTANTIATE_TEST_SUITE_P(OnDisk, EngineConformance, ::testing::Values(EngineKind{"RocksDb", rocksdb_store}),
                         [](const auto& kind) { return kind.param.name; });

TEST(RocksDbEngine, ASecondOwnerOfTheFolderIsRefused) {
  const TemporaryFolder folder;
  const auto first = open_rocksdb(folder / "data");
  ASSERT_TRUE(first.ok()) << first.status().to_string();
  EXPECT_EQ(open_rocksdb(folder / "data").reason(), Reason::FOLDER_LOCKED);
}

TEST(RocksDbEngine, VerifyingAJournalThatIsTrimmedMeanwhileFindsNothingMissing) {
  const TemporaryFolder folder;
  const auto engine = open_rocksdb(folder / "data").value();
  const auto epoch = engine->acquire().value();
  const std::vector<Bytes> group(10, encode_record(KeyframeRecord{1, 0, Bytes(std::size_t{1} << 20, 7)}, 0));
  for (int k = 0; k < 5; ++k) ASSERT_TRUE(engine->append(epoch, group).ok());  // four segments
  std::vector<std::string> findings;
  const auto found = [&](const Finding& finding) { findings.push_back(finding.what); };
  bool trimmed = false;
  const auto summary = verify_journal(*engine, found, [&](const MaintenanceProgress&) {
    if (!trimmed) trimmed = engine->commit(epoch, 45, {}, {}).ok() && engine->trim(45).ok();
    return true;
  });
  ASSERT_TRUE(summary.ok()) << summary.status().to_string();
  EXPECT_TRUE(trimmed);
  EXPECT_LT(summary->journal_records, 50u);
  EXPECT_EQ(findings, std::vector<std::string>());
}

TEST(RocksDbEngine, AnUnknownFormatIsRefusedByName) {
  const TemporaryFolder folder;
  ASSERT_TRUE(open_rocksdb(folder / "data").ok());
  std::ofstream(folder / "data/FORMAT") << "relmap map 999\n";
  EXPECT_EQ(open_rocksdb(folder / "data").reason(), Reason::UNKNOWN_FORMAT_VERSION);
}

TEST(RocksDbEngine, ReadOnlyRefusesWrites) {
  const TemporaryFolder folder;
  const std::vector<Bytes> records{{1}, {2}};
  {
    const auto engine = open_rocksdb(folder / "data").value();
    const auto epoch = engine->acquire().value();
    ASSERT_TRUE(engine->append(epoch, records).ok());
    const std::vector<Put> puts{{"k", {5}}};
    ASSERT_TRUE(engine->commit(epoch, 1, puts, {}).ok());
  }
  RocksDbOptions options;
  options.read_only = true;
  EXPECT_EQ(open_rocksdb(folder / "nothing", options).reason(), Reason::NO_SUCH_FILE);
  const auto engine = open_rocksdb(folder / "data", options).value();
  EXPECT_EQ(engine->acquire().reason(), Reason::READ_ONLY);
  EXPECT_EQ(engine->append(1, records).reason(), Reason::READ_ONLY);
  EXPECT_EQ(engine->commit(1, 2, {}, {}).reason(), Reason::READ_ONLY);
  EXPECT_EQ(engine->last_journal_sequence(), 2u);
  EXPECT_EQ(engine->snapshot()->get("k").value(), Bytes{5});
}

TEST(RocksDbEngine, ACheckpointOpensAsTheMapItWasTakenFrom) {
  const TemporaryFolder folder;
  const auto engine = open_rocksdb(folder / "data").value();
  const auto epoch = engine->acquire().value();
  const std::vector<Bytes> records{{1}, {2}, {3}};
  ASSERT_TRUE(engine->append(epoch, records).ok());
  const std::vector<Put> puts{{"k", Bytes(50000, 5)}};
  ASSERT_TRUE(engine->commit(epoch, 2, puts, {}).ok());
  ASSERT_TRUE(engine->checkpoint(folder / "copy", patient).ok());
  EXPECT_EQ(engine->checkpoint(folder / "copy", patient).reason(), Reason::INVALID_ARGUMENT);

  const auto copy = open_rocksdb(folder / "copy").value();
  EXPECT_EQ(copy->applied_sequence(), 2u);
  EXPECT_EQ(copy->last_journal_sequence(), 3u);
  EXPECT_EQ(copy->snapshot()->get("k").value(), Bytes(50000, 5));
}

// By whatever name: neither in the map's own folder, nor in one inside it, nor in one that contains it.
TEST(RocksDbEngine, ACheckpointIsNotMadeInTheFolderOfTheMap) {
  const TemporaryFolder folder;
  const std::string data = folder / "maps/data";
  const auto engine = open_rocksdb(data).value();
  const auto names = [&] {
    std::set<std::string> all;
    for (const auto& entry : fs::recursive_directory_iterator(folder / ""))
      if (entry.path().filename() != "LOG") all.insert(entry.path().string());
    return all;
  };
  fs::create_directory_symlink(data, folder / "link");
  fs::create_directory_symlink(data + "/map", folder / "deep");
  fs::create_directory_symlink(data + "/backup", folder / "nowhere");
  fs::create_directories(folder / "elsewhere");
  const auto before = names();
  for (const std::string& copy :
       {data, data + "/", data + "/backup", data + "/a/b/backup", data + "/map", data + "/map/../backup",
        folder / "elsewhere/../maps/data/backup", folder / "link", folder / "link/backup", folder / "deep/../backup",
        folder / "deep/backup", folder / "maps", folder / "", folder / "nowhere",
        fs::relative(data + "/backup").string()}) {
    const Status refused = engine->checkpoint(copy, patient);
    EXPECT_EQ(refused.reason(), Reason::INVALID_ARGUMENT) << copy << ": " << refused.to_string();
    EXPECT_EQ(names(), before) << copy;
  }
  EXPECT_THAT(engine->checkpoint(folder / "link/backup", patient).message(), testing::HasSubstr("lies in " + data));
  EXPECT_THAT(engine->checkpoint(folder / "maps", patient).message(),
              testing::HasSubstr("lies in " + (folder / "maps")));

  // While it is made, the copy would have the name that the map has.
  const auto odd = open_rocksdb(folder / "odd.partial").value();
  EXPECT_EQ(odd->checkpoint(folder / "odd", patient).reason(), Reason::INVALID_ARGUMENT);

  // A folder beside the map is accepted, even if its path leads through the map's folder.
  EXPECT_TRUE(engine->checkpoint(data + "/../backup", patient).ok());
  EXPECT_TRUE(fs::exists(folder / "maps/backup/FORMAT"));
  EXPECT_TRUE(engine->checkpoint(data + "-monday", patient).ok()) << "though its name begins as that of the map";
}

TEST(RocksDbEngine, ACheckpointRecordsTheHashOfItsMap) {
  const TemporaryFolder folder;
  const auto engine = open_rocksdb(folder / "data").value();
  const auto budget = std::make_shared<Budget>(std::size_t{64} << 20);
  const auto map = Map::open(engine, engine->acquire().value(), budget).value();
  RandomFrames random(4);
  Session session = random.session(1);
  session.first = session.last = 0;
  session.frames = 1;
  map->add_session(session);
  FrameCold cold = random.cold();
  FrameHot hot = random.hot({1, 0});
  hot.appearance_count = static_cast<std::uint32_t>(cold.appearance.size());
  map->add_frame({1, 0}, std::move(hot), random.warm(), std::move(cold));
  ASSERT_TRUE(map->commit().ok());
  EXPECT_FALSE(read_recorded_hash(folder / "data").value());
  ASSERT_TRUE(engine->checkpoint(folder / "copy", patient).ok());
  const auto recorded = read_recorded_hash(folder / "copy").value();
  ASSERT_TRUE(recorded);
  EXPECT_EQ(recorded->commit, engine->snapshot()->commit_number());
  EXPECT_EQ(recorded->hash, hash_map(*map));

  const auto copy = open_rocksdb(folder / "copy").value();
  EXPECT_EQ(agrees_with_recorded_hash(folder / "copy", *copy->snapshot(), patient).value(), true);
  fs::remove(folder / "copy/HASH");
  ASSERT_TRUE(write_recorded_hash(folder / "copy", {recorded->commit, {1, 2}}).ok());
  EXPECT_EQ(agrees_with_recorded_hash(folder / "copy", *copy->snapshot(), patient).reason(), Reason::DATA_LOSS);
  std::ofstream(folder / "copy/HASH") << "relmap hash 1 comm";
  EXPECT_EQ(agrees_with_recorded_hash(folder / "copy", *copy->snapshot(), patient).reason(), Reason::DATA_LOSS);
  std::ofstream(folder / "copy/HASH") << "relmap hash 99 of a later version\n";
  EXPECT_EQ(agrees_with_recorded_hash(folder / "copy", *copy->snapshot(), patient).value(), false);
  fs::remove(folder / "copy/HASH");
  ASSERT_TRUE(write_recorded_hash(folder / "copy", {recorded->commit - 1, {1, 2}}).ok());
  EXPECT_EQ(agrees_with_recorded_hash(folder / "copy", *copy->snapshot(), patient).value(), false);
}

TEST(RocksDbEngine, WhatIsRestoredIsTheMapWithAHigherEpoch) {
  const TemporaryFolder folder;
  const MapIdentity identity{Uuid::random(), 1000};
  const auto budget = std::make_shared<Budget>(std::size_t{64} << 20);
  MapHash hash;
  {
    const auto engine = open_rocksdb(folder / "data").value();
    const auto map = Map::open(engine, engine->acquire().value(), budget).value();
    map->state().identity = identity;
    map->state().keyframes = 3;
    ASSERT_TRUE(map->commit().ok());
    hash = hash_map(*map);
    ASSERT_TRUE(engine->checkpoint(folder / "copy", patient).ok());
  }
  // Two restores of one backup have different epochs, and a restore of a restored map has a later one whatever the
  // clock says.
  for (const auto& [name, now, epoch] : {std::tuple{"early", 5000, 5000}, {"late", 6000, 6000}, {"slow", 10, 1001}}) {
    const auto restored = restore_folder(folder / "copy", folder / name, static_cast<std::uint64_t>(now), patient);
    ASSERT_TRUE(restored.ok()) << restored.status().to_string();
    EXPECT_TRUE(restored->unmarked.ok());
    EXPECT_EQ(restored->map, (MapIdentity{identity.uuid, static_cast<std::uint64_t>(epoch)}));
    const auto engine = open_rocksdb(folder / name).value();
    const auto map = Map::open(engine, engine->acquire().value(), budget).value();
    EXPECT_EQ(map->state().identity, restored->map);
    EXPECT_EQ(map->state().keyframes, 3u);
    EXPECT_EQ(hash_map(*map), hash);
    EXPECT_EQ(agrees_with_recorded_hash(folder / name, *engine->snapshot(), patient).value(), true);
  }
  EXPECT_FALSE(fs::exists(folder / "early.partial"));
}

// Keyframes go on coming, and the journal is trimmed all the time.
TEST(RocksDbEngine, ACheckpointHasAllThatWasDurableBeforeItWhileWorkGoesOn) {
  const TemporaryFolder folder;
  const auto engine = open_rocksdb(folder / "data").value();
  const auto epoch = engine->acquire().value();
  std::atomic<std::uint64_t> durable{0};
  std::atomic<bool> done{false};
  std::thread worker([&] {
    for (std::uint64_t i = 1; !done; ++i) {
      const std::vector<Bytes> records{Bytes(100000, static_cast<std::uint8_t>(i))};
      EXPECT_TRUE(engine->append(epoch, records).ok());
      durable = i;
      if (i % 3 == 0) {
        const std::vector<Put> puts{{"k" + std::to_string(i), records[0]}};
        EXPECT_TRUE(engine->commit(epoch, i - 1, puts, {}).ok());
        EXPECT_TRUE(engine->trim(i - 1).ok());
      }
    }
  });
  for (int copy = 0; copy < 5; ++copy) {
    while (durable < static_cast<std::uint64_t>(copy) * 100 + 50) std::this_thread::yield();
    const std::uint64_t before = durable;
    const std::string name = folder / ("copy" + std::to_string(copy));
    const Status made = engine->checkpoint(name, patient);
    ASSERT_TRUE(made.ok()) << made.to_string();
    const auto opened = open_rocksdb(name).value();
    EXPECT_GE(opened->last_journal_sequence(), before);
    EXPECT_EQ(opened->stats()->dropped, "");
    std::uint64_t next = opened->applied_sequence() + 1;
    const Status read = opened->read_journal(next, [&](std::uint64_t sequence, ByteSpan record) {
      return sequence == next++ &&
             Bytes(record.begin(), record.end()) == Bytes(100000, static_cast<std::uint8_t>(sequence));
    });
    EXPECT_TRUE(read.ok()) << read.to_string();
    EXPECT_EQ(next, opened->last_journal_sequence() + 1);
  }
  done = true;
  worker.join();
}

TEST(RocksDbEngine, AnUnfinishedCheckpointIsNeverTakenForAWholeOne) {
  const TemporaryFolder folder;
  const auto engine = open_rocksdb(folder / "data").value();
  const auto epoch = engine->acquire().value();
  const std::vector<Put> puts{{"k", Bytes(50000, 5)}};
  ASSERT_TRUE(engine->commit(epoch, 0, puts, {}).ok());
  const Status stopped = engine->checkpoint(
      folder / "copy", [](std::uint64_t, std::uint64_t) { return Status(Reason::DEADLINE, "no more time"); });
  EXPECT_EQ(stopped.reason(), Reason::DEADLINE);
  EXPECT_FALSE(fs::exists(folder / "copy"));
  EXPECT_FALSE(fs::exists(folder / "copy.partial"));

  // The next attempt removes what a process that died on the way left; what is not ours is not touched.
  fs::create_directories(folder / "copy.partial/map");
  std::ofstream(folder / "copy.partial/map/000001.sst") << "half a table";
  EXPECT_EQ(engine->checkpoint(folder / "copy", patient).reason(), Reason::INVALID_ARGUMENT);
  std::ofstream(folder / "copy.partial/LOCK");
  EXPECT_TRUE(engine->checkpoint(folder / "copy/", patient).ok());
  EXPECT_FALSE(fs::exists(folder / "copy/map/000001.sst"));
  EXPECT_EQ(open_rocksdb(folder / "copy").value()->snapshot()->get("k").value(), Bytes(50000, 5));
}

TEST(RocksDbEngine, CompactionGivesBackWhatWasReplaced) {
  const TemporaryFolder folder;
  const auto engine = open_rocksdb(folder / "data").value();
  const auto epoch = engine->acquire().value();
  for (int round = 0; round < 6; ++round)
    for (int key = 0; key < 20; ++key) {
      const std::vector<Put> puts{{"k" + std::to_string(key), Bytes(100000, static_cast<std::uint8_t>(round))}};
      ASSERT_TRUE(engine->commit(epoch, 0, puts, {}).ok());
    }
  ASSERT_TRUE(engine->compact(patient).ok());
  const EngineStats after = engine->stats().value();
  EXPECT_LT(after.map_bytes, 20u * 100000 * 3 / 2);
  EXPECT_GE(after.blob_bytes, 20u * 100000);
  EXPECT_EQ(after.garbage_bytes, 0u);
  for (int key = 0; key < 20; ++key)
    EXPECT_EQ(engine->snapshot()->get("k" + std::to_string(key)).value(), Bytes(100000, 5));
}

TEST(RocksDbEngine, ALostJournalRecordIsNamed) {
  const TemporaryFolder folder;
  {
    const auto engine = open_rocksdb(folder / "data").value();
    const auto epoch = engine->acquire().value();
    for (std::uint8_t i = 1; i <= 5; ++i) {
      const std::vector<Bytes> records{Bytes(100, i)};
      ASSERT_TRUE(engine->append(epoch, records).ok());
    }
  }
  const auto segment = fs::directory_iterator(folder / "data/journal")->path();
  std::fstream file(segment, std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(32 + 2 * 132 + 60);  // in the third record
  file.put(9);
  file.close();
  const auto engine = open_rocksdb(folder / "data").value();
  std::uint64_t last = 0;
  const Status read = engine->read_journal(1, [&](std::uint64_t sequence, ByteSpan) {
    last = sequence;
    return true;
  });
  EXPECT_EQ(last, 2u);
  EXPECT_EQ(read.reason(), Reason::DATA_LOSS);
  EXPECT_NE(read.message().find("3..4"), std::string::npos) << read.message();
  const std::vector<Bytes> records{{1}};
  EXPECT_EQ(engine->append(engine->acquire().value(), records).reason(), Reason::DATA_LOSS);
}

TEST(RocksDbEngine, AMapComesBackFromDisk) {
  const TemporaryFolder folder;
  RandomFrames random(3);
  MapHash hash;
  {
    const auto engine = open_rocksdb(folder / "data").value();
    auto map = Map::open(engine, engine->acquire().value(), std::make_shared<Budget>(std::size_t{64} << 20)).value();
    Session session;
    session.number = engine->allocate_session(1).value();
    map->add_session(session);
    for (std::uint32_t i = 0; i < 150; ++i) {
      map->add_frame({1, i}, random.hot({1, i}), random.warm(), random.cold());
      map->edit_session(1).last = i;
      ++map->edit_session(1).frames;
      if (i % 20 == 0) {
        ASSERT_TRUE(map->commit().ok());
      }
    }
    ASSERT_TRUE(map->commit().ok());
    hash = hash_map(*map);
  }
  const auto engine = open_rocksdb(folder / "data").value();
  const auto map =
      Map::open(engine, engine->acquire().value(), std::make_shared<Budget>(std::size_t{64} << 20)).value();
  EXPECT_EQ(hash_map(*map), hash);
}

}  // namespace
}  // namespace relmap::storage
