// Power failures under RocksDB and under the journal: what was acknowledged is there afterwards.
#include <gtest/gtest.h>

#include <random>
#include <utility>

#include "storage/rocksdb/rocksdb_engine.h"
#include "storage/rocksdb/testing/forgetful_map_files.h"
#include "storage/testing/forgetful_files.h"
#include "storage/testing/temporary_folder.h"

namespace relmap::storage {
namespace {

Bytes payload(std::uint64_t sequence, std::size_t words) {
  ByteWriter w;
  for (std::uint64_t i = 0; i <= words; ++i) w.put(sequence * 77 + i);
  return w.take();
}

struct Syncs {
  bool journal = true, map = true;
};

// Says what is wrong after `crashes` power failures; empty if nothing is.
std::string run(std::uint64_t seed, Syncs sync, int crashes) {
  const TemporaryFolder folder;
  std::mt19937_64 rng(seed);
  const auto below = [&](std::uint64_t n) { return std::uniform_int_distribution<std::uint64_t>(0, n - 1)(rng); };
  RocksDbOptions options;
  options.cache_bytes = std::size_t{8} << 20;
  const auto journal_files = ForgetfulFiles::create(seed, sync.journal);
  const auto map_files = std::make_shared<ForgetfulMapFiles>(seed, sync.map);
  options.space.reserve = std::size_t{1} << 20;
  options.journal_files = journal_files;
  options.map_files = map_files;
  options.folder_files = std::make_shared<ForgetfulFolders>(map_files);
  std::uint64_t acknowledged = 0, committed = 0;
  for (int crash = 0; crash <= crashes; ++crash) {
    auto opened = open_rocksdb(folder / "data", options);
    if (!opened.ok()) return "after crash " + std::to_string(crash) + ": " + opened.status().to_string();
    Engine& engine = **opened;
    if (engine.last_journal_sequence() < acknowledged) return "an acknowledged record was lost";
    if (engine.applied_sequence() < committed) return "a commit was lost";
    std::uint64_t next = engine.first_journal_sequence();
    const Status read = engine.read_journal(1, [&](std::uint64_t sequence, ByteSpan record) {
      return sequence == next++ && Bytes(record.begin(), record.end()) == payload(sequence, 5);
    });
    if (!read.ok()) return read.to_string();
    if (next != engine.last_journal_sequence() + 1) return "the journal is not what was written";
    for (const char* key : {"small", "blob"}) {  // one in the table, one in a blob file
      const auto value = engine.snapshot()->get(key);
      if (!value.ok()) return value.status().to_string();
      const Bytes expected = payload(engine.applied_sequence(), key[0] == 'b' ? 2000 : 5);
      if (engine.applied_sequence() > 0 && *value != expected) return std::string("a commit is there in part: ") + key;
    }
    map_files->fail_power_after(1 + below(40));
    if (below(3) == 0) journal_files->fail_power_after(1 + below(40));
    std::uint64_t last = engine.last_journal_sequence();
    const auto epoch = engine.acquire();
    while (epoch.ok() && map_files->has_power() && journal_files->has_power()) {
      const std::vector<Bytes> records{payload(last + 1, 5), payload(last + 2, 5)};
      if (!engine.append(*epoch, records).ok()) break;
      acknowledged = last += 2;
      const std::vector<Put> puts{{"small", payload(last, 5)}, {"blob", payload(last, 2000)}};
      if (!engine.commit(*epoch, last, puts, {}).ok()) break;
      committed = last;
      if (!engine.trim(last).ok()) break;
    }
    opened = Status(Reason::IO_ERROR, "closed");
    map_files->restart();
    journal_files->restart();
  }
  return "";
}

// Syncs every folder but `unsynced`.
class ForgottenSync final : public ForgetfulFolders {
 public:
  ForgottenSync(std::shared_ptr<ForgetfulMapFiles> disk, std::string unsynced)
      : ForgetfulFolders(std::move(disk)), unsynced_(std::move(unsynced)) {}
  Status sync_directory(const std::string& path) override {
    return path == unsynced_ ? Status() : ForgetfulFolders::sync_directory(path);
  }

 private:
  const std::string unsynced_;
};

constexpr int kNewMaps = 20;

// A new map is made in a/b/data, of which no folder exists, and the power fails after its first commit. Returns in how
// many of kNewMaps runs the commit is lost. The sync of the folder above `unsynced` is left out; empty: of none.
int lost_commits(const std::string& unsynced) {
  int lost = 0;
  for (std::uint64_t seed = 1; seed <= kNewMaps; ++seed) {
    const TemporaryFolder folder;
    const std::string data = folder / "a/b/data";
    const auto map_files = std::make_shared<ForgetfulMapFiles>(seed, true);
    RocksDbOptions options;
    options.cache_bytes = std::size_t{8} << 20;
    options.map_files = map_files;
    options.folder_files =
        std::make_shared<ForgottenSync>(map_files, unsynced.empty() ? "" : folder_of(folder / unsynced));
    auto engine = open_rocksdb(data, options).or_throw();
    const std::uint64_t epoch = engine->acquire().or_throw();
    const std::uint64_t sequence = engine->append(epoch, std::vector<Bytes>{payload(1, 5)}).or_throw();
    const std::vector<Put> puts{{"small", payload(sequence, 5)}};
    EXPECT_TRUE(engine->commit(epoch, sequence, puts, {}).ok());
    engine.reset();
    map_files->restart();
    const auto again = open_rocksdb(data, options);
    lost += !again.ok() || (*again)->applied_sequence() != sequence;
  }
  return lost;
}

TEST(RocksDbDurability, ANewMapStaysWithAllFoldersAboveItThatWereMissing) { EXPECT_EQ(lost_commits(""), 0); }
TEST(RocksDbDurability, TheCheckCatchesAFolderOfANewMapWhoseNameIsNotSynced) {
  for (const char* unsynced : {"a", "a/b", "a/b/data", "a/b/data/map"}) {
    const int lost = lost_commits(unsynced);
    EXPECT_GT(lost, 0) << unsynced;
    EXPECT_LT(lost, kNewMaps) << unsynced << ": by chance the name reaches the disk";
  }
}

TEST(RocksDbDurability, NothingAcknowledgedIsLostOverTwentyCrashes) { EXPECT_EQ(run(1, {}, 20), ""); }

TEST(RocksDbDurability, TheCheckCatchesAJournalThatDoesNotSync) { EXPECT_NE(run(1, {false, true}, 20), ""); }
TEST(RocksDbDurability, TheCheckCatchesAMapThatDoesNotSync) { EXPECT_NE(run(1, {true, false}, 20), ""); }

}  // namespace
}  // namespace relmap::storage
