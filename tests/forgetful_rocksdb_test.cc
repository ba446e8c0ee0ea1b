// Like forgetful_disk_test, with the engine of a data folder: the power fails for RocksDB, the journal and the folders
// together.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "storage/journal/journal_log.h"
#include "storage/rocksdb/rocksdb_engine.h"
#include "storage/rocksdb/testing/forgetful_map_files.h"
#include "storage/testing/forgetful_files.h"
#include "storage/testing/temporary_folder.h"
#include "tests/support/power_failure_checks.h"

namespace relmap::testing {
namespace {

using ::testing::ContainsRegex;

class Disk final : public FailingDisk {
 public:
  Disk(std::uint64_t seed, bool sync)
      : journal_(storage::ForgetfulFiles::create(seed, sync)),
        map_(std::make_shared<storage::ForgetfulMapFiles>(seed, sync)) {}

  Result<std::shared_ptr<storage::Engine>> open() override {
    storage::RocksDbOptions options;
    options.cache_bytes = std::size_t{8} << 20;
    options.space.reserve = std::size_t{1} << 20;
    options.journal_files = journal_;
    options.map_files = map_;
    options.folder_files = std::make_shared<storage::ForgetfulFolders>(map_);
    return storage::open_rocksdb(folder_ / "data", options);
  }
  void fail_power_after(std::uint64_t operations) override {
    // Both are on one machine: when one loses power, has_power() is false for both.
    journal_->fail_power_after(operations);
    map_->fail_power_after(operations);
  }
  bool has_power() const override { return journal_->has_power() && map_->has_power(); }
  std::uint64_t certain_through(std::uint64_t first) const override {
    const std::string folder = folder_ / "data/journal";
    return storage::JournalLog::open(journal_->certain(folder), folder, first - 1, {.read_only = true})
        .or_throw()
        ->last();
  }
  void restart() override {
    map_->restart();
    journal_->restart();
  }

 private:
  const storage::TemporaryFolder folder_;
  const std::shared_ptr<storage::ForgetfulFiles> journal_;
  const std::shared_ptr<storage::ForgetfulMapFiles> map_;
};

TEST(ForgetfulRocksDb, NoAcknowledgedKeyframeIsLostOrDoubledOverFiftyPowerFailures) { fail_often<Disk>(1, 2); }
TEST(LongForgetfulRocksDb, NoAcknowledgedKeyframeIsLostOrDoubledOverFiveHundredPowerFailures) {
  fail_often<Disk>(100, 20);
}

TEST(ForgetfulRocksDb, TheLossIsSeenWhenNothingIsSynced) {
  Disk disk(1, false);
  EXPECT_THAT(run_with_power_failures(disk, kFailures, 1, false).wrong,
              ContainsRegex("lost|acknowledged through|DATA_LOSS|verify|opening of the map|CURRENT"));
}

TEST(ForgetfulRocksDb, AnAcknowledgementBeforeItsSyncIsSeen) {
  Disk disk(1, false);
  EXPECT_THAT(run_with_power_failures(disk, 0, 1).wrong, ContainsRegex("acknowledged before its sync"));
}

}  // namespace
}  // namespace relmap::testing
