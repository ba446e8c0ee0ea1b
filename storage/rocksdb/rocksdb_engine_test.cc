#include "storage/rocksdb/rocksdb_engine.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <random>
#include <set>
#include <thread>
#include <utility>

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
    EXPECT_TRUE(map->digests_hold());
    EXPECT_EQ(agrees_with_recorded_hash(folder / name, *engine->snapshot(), patient).value(), true);
    EXPECT_GT(engine->allocate_session(engine->acquire().value()).value(), 1u << 20)
        << "the map that was backed up may have given out others since";
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
  EXPECT_EQ(engine->checkpoint(folder / "copy", patient).reason(), Reason::INVALID_ARGUMENT)
      << "any file may be called so";
  EXPECT_TRUE(fs::exists(folder / "copy.partial/map/000001.sst"));
  std::ofstream(folder / "copy.partial/PARTIAL") << "relmap partial folder 1\n";
  EXPECT_TRUE(engine->checkpoint(folder / "copy/", patient).ok());
  EXPECT_FALSE(fs::exists(folder / "copy/map/000001.sst"));
  EXPECT_EQ(open_rocksdb(folder / "copy").value()->snapshot()->get("k").value(), Bytes(50000, 5));
}

// Files and folders below `folder`, links as such, with what they hold.
std::map<std::string, std::string> tree(const std::string& folder) {
  std::map<std::string, std::string> all;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    std::string text = entry.is_symlink()     ? "link to " + fs::read_symlink(entry.path()).string()
                       : entry.is_directory() ? "folder"
                                              : "";
    if (text.empty()) {
      std::ifstream file(entry.path(), std::ios::binary);
      text.assign(std::istreambuf_iterator<char>(file), {});
    }
    all[entry.path().string()] = std::move(text);
  }
  return all;
}

// All but RocksDB's own log, to which it adds a line now and then.
std::map<std::string, std::string> tree_without_log(const std::string& folder) {
  auto all = tree(folder);
  std::erase_if(all, [](const auto& entry) { return fs::path(entry.first).filename().string().starts_with("LOG"); });
  return all;
}

// Whoever may ask for backups chooses a path, and other users of the machine may put links where it leads.
TEST(RocksDbEngine, ACheckpointIsMadeOnlyBelowItsRootsAndThroughNoLink) {
  const TemporaryFolder folder;
  const std::string root = folder / "backups";
  const auto engine = open_rocksdb(folder / "data").value();
  const auto epoch = engine->acquire().value();
  const std::vector<Put> puts{{"k", Bytes(50000, 5)}};
  ASSERT_TRUE(engine->commit(epoch, 0, puts, {}).ok());
  fs::create_directories(folder / "victim/map");
  std::ofstream(folder / "victim/map/precious.sst") << "of another user";
  std::ofstream(folder / "victim/LOCK") << "1";
  fs::create_directories(root + "/open");
  fs::create_directories(root + "/theirs");
  fs::permissions(root, fs::perms::owner_all);
  fs::permissions(root + "/open", fs::perms::all);
  const bool is_root = ::geteuid() == 0;
  if (is_root) {
    ASSERT_EQ(::chown((root + "/theirs").c_str(), 65534, 65534), 0);
  }
  fs::create_directory_symlink(folder / "victim", root + "/link");
  fs::create_directory_symlink(folder / "data", root + "/live");
  fs::create_directory_symlink(folder / "victim", root + "/copy.partial");
  fs::create_directory_symlink(folder / "victim", root + "/other");
  const auto names = [&] { return tree_without_log(folder / ""); };
  const auto before = names();
  std::vector<std::string> bad{folder / "elsewhere",
                               root,
                               root + "/../elsewhere",
                               root + "/link/a",
                               root + "/link",
                               root + "/live",
                               root + "/live/backup",
                               root + "/live/map",
                               root + "/open/a",
                               root + "/copy",
                               root + "/other",
                               folder / "data/backup",
                               folder / "data",
                               "/",
                               root + "/link/../../victim/map"};
  if (is_root) bad.push_back(root + "/theirs/a");
  for (const std::string& to : bad) {
    const Status refused = engine->checkpoint({to, {root}}, patient);
    EXPECT_TRUE(refused.reason() == Reason::NOT_ALLOWED || refused.reason() == Reason::INVALID_ARGUMENT)
        << to << ": " << refused.to_string();
    EXPECT_TRUE(names() == before) << to;
  }
  fs::permissions(root, fs::perms::all);
  EXPECT_EQ(engine->checkpoint({root + "/a", {root}}, patient).reason(), Reason::NOT_ALLOWED) << "everyone's folder";
  fs::permissions(root, fs::perms::owner_all);
  // Nor where others can put another folder in the root's place, or change a link on the way to it.
  fs::create_directories(folder / "shared/backups");
  fs::create_directory_symlink(root, folder / "shared/link");
  fs::permissions(folder / "shared", fs::perms::all);
  for (const std::string way : {"shared/backups", "shared/link"})
    EXPECT_EQ(engine->checkpoint({folder / (way + "/a"), {folder / way}}, patient).reason(), Reason::NOT_ALLOWED)
        << way;
  fs::permissions(folder / "shared", fs::perms::all | fs::perms::sticky_bit);
  EXPECT_TRUE(engine->checkpoint({folder / "shared/link/a", {folder / "shared/link"}}, patient).ok());
  fs::remove_all(root + "/a");
  fs::remove_all(folder / "shared");
  EXPECT_TRUE(names() == before);

  const Status made = engine->checkpoint({root + "/monday/morning", {folder / "nowhere", root}}, patient);
  ASSERT_TRUE(made.ok()) << made.to_string();
  EXPECT_EQ(open_rocksdb(root + "/monday/morning").value()->snapshot()->get("k").value(), Bytes(50000, 5));
  EXPECT_FALSE(fs::exists(root + "/monday/morning/PARTIAL"));
  EXPECT_EQ(fs::status(root + "/monday").permissions(), fs::perms::owner_all);
  EXPECT_EQ(fs::status(root + "/monday/morning").permissions(), fs::perms::owner_all);
}

// While the copy is made, its folder is moved away and a link to another folder put in its place.
TEST(RocksDbEngine, ACheckpointWhoseFolderIsSwappedWritesNowhereElse) {
  const TemporaryFolder folder;
  const std::string root = folder / "backups";
  const auto engine = open_rocksdb(folder / "data").value();
  const auto epoch = engine->acquire().value();
  const std::vector<Put> puts{{"k", Bytes(50000, 5)}};
  ASSERT_TRUE(engine->commit(epoch, 0, puts, {}).ok());
  fs::create_directories(folder / "victim/map");
  std::ofstream(folder / "victim/map/precious.sst") << "of another user";
  fs::create_directories(root);
  fs::permissions(root, fs::perms::owner_all);
  const auto victim = tree(folder / "victim");
  // What is in memory goes to files before the first copy.
  ASSERT_TRUE(engine->checkpoint({root + "/first", {root}}, patient).ok());
  const auto live = tree_without_log(folder / "data");
  for (const std::string& target : {folder / "victim", folder / "data"}) {
    bool swapped = false;
    const Status refused = engine->checkpoint({root + "/copy", {root}}, [&](std::uint64_t, std::uint64_t) {
      if (!std::exchange(swapped, true)) {
        fs::rename(root + "/copy.partial", folder / "moved");
        fs::create_directory_symlink(target, root + "/copy.partial");
      }
      return Status();
    });
    EXPECT_TRUE(swapped);
    EXPECT_EQ(refused.reason(), Reason::IO_ERROR) << refused.to_string();
    EXPECT_THAT(refused.message(), testing::HasSubstr("replaced by something else"));
    EXPECT_EQ(tree(folder / "victim"), victim);
    EXPECT_TRUE(tree_without_log(folder / "data") == live);
    EXPECT_EQ(engine->snapshot()->get("k").value(), Bytes(50000, 5));
    EXPECT_FALSE(fs::exists(root + "/copy"));
    EXPECT_TRUE(fs::is_symlink(root + "/copy.partial")) << "what is not ours is not removed";
    EXPECT_TRUE(fs::is_empty(folder / "moved")) << "what was written is removed, wherever it is";
    fs::remove(root + "/copy.partial");
    fs::remove_all(folder / "moved");
  }
}

// Whether a file of the folder holds these bytes.
bool on_disk(const std::string& folder, const Bytes& bytes) {
  const std::string wanted(bytes.begin(), bytes.end());
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    std::ifstream file(entry.path(), std::ios::binary);
    const std::string text(std::istreambuf_iterator<char>(file), {});
    if (text.find(wanted) != std::string::npos) return true;
  }
  return false;
}

// A day is one of the engine's clock. What remains of the session's neighbours is untouched.
TEST(RocksDbEngine, DeletedPicturesAreOffTheDiskWithinADay) {
  const TemporaryFolder folder;
  std::atomic<std::chrono::steady_clock::time_point> time = std::chrono::steady_clock::time_point{};
  std::mt19937 random(1);
  const auto picture = [&] {
    Bytes bytes(40000);
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
    return bytes;
  };
  RocksDbOptions options;
  options.now = [&] { return time.load(); };
  // "c": cold parts, as storage/format/keys.h names them.
  const Bytes deleted = picture(), kept = picture(), later = picture();
  const auto gone = [&](const Bytes& bytes) {
    for (int i = 0; i < 1000 && on_disk(folder / "data", bytes); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    return !on_disk(folder / "data", bytes);
  };
  std::uint64_t epoch = 0;
  {
    const auto engine = open_rocksdb(folder / "data", options).value();
    epoch = engine->acquire().value();
    const std::vector<Bytes> records{deleted, kept};
    ASSERT_TRUE(engine->append(epoch, records).ok());
    const std::vector<Put> puts{{"c1", deleted}, {"c2", kept}, {"c3", later}, {"k", Bytes(10, 1)}};
    ASSERT_TRUE(engine->commit(epoch, 2, puts, {}).ok());
    ASSERT_TRUE(engine->trim(2).ok());
    const std::vector<std::string> deletes{"c1"};
    ASSERT_TRUE(engine->commit(epoch, 2, {}, deletes).ok());
    EXPECT_TRUE(on_disk(folder / "data", deleted)) << "so far, only its key is gone";
    time = time.load() + std::chrono::hours(11);
    ASSERT_TRUE(engine->commit(epoch, 2, {}, {}).ok());
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    EXPECT_TRUE(on_disk(folder / "data", deleted));
    time = time.load() + std::chrono::hours(1);
    ASSERT_TRUE(engine->commit(epoch, 2, {}, {}).ok());
    EXPECT_TRUE(gone(deleted));
    EXPECT_EQ(engine->snapshot()->get("c2").value(), kept);
    EXPECT_EQ(engine->snapshot()->get("c1").value(), std::nullopt);
    EXPECT_EQ(engine->snapshot()->get("k").value(), Bytes(10, 1));
    ASSERT_TRUE(engine->append(epoch, std::vector<Bytes>{Bytes(5)}).ok());
    EXPECT_EQ(engine->last_journal_sequence(), 3u);
    const std::vector<std::string> more{"c3"};
    ASSERT_TRUE(engine->commit(epoch, 3, {}, more).ok());
  }
  // A restart forgets when something was deleted, and not that it was.
  const auto engine = open_rocksdb(folder / "data", options).value();
  epoch = engine->acquire().value();
  EXPECT_TRUE(on_disk(folder / "data", later));
  time = time.load() + std::chrono::hours(1);
  ASSERT_TRUE(engine->commit(epoch, 3, {}, {}).ok());
  EXPECT_TRUE(gone(later));
  EXPECT_EQ(engine->snapshot()->get("c2").value(), kept);
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
