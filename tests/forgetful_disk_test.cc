// After power failures no acknowledged keyframe is lost and none is doubled: intake, journal and worker on a disk that
// forgets what was not synced.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "storage/journal/journal_log.h"
#include "storage/testing/fault_engine.h"
#include "storage/testing/forgetful_files.h"
#include "tests/support/power_failure_checks.h"

namespace relmap::testing {
namespace {

using ::testing::ContainsRegex;

class Disk final : public FailingDisk {
 public:
  Disk(std::uint64_t seed, bool sync) : files_(storage::ForgetfulFiles::create(seed, sync)) {}
  Result<std::shared_ptr<storage::Engine>> open() override { return storage::open_fault_engine(files_); }
  void fail_power_after(std::uint64_t operations) override { files_->fail_power_after(operations); }
  bool has_power() const override { return files_->has_power(); }
  void restart() override { files_->restart(); }
  std::uint64_t certain_through(std::uint64_t first) const override {
    return storage::JournalLog::open(files_->certain("journal"), "journal", first - 1, {.read_only = true})
        .or_throw()
        ->last();
  }

 private:
  const std::shared_ptr<storage::ForgetfulFiles> files_;
};

TEST(ForgetfulDisk, NoAcknowledgedKeyframeIsLostOrDoubledOverFiftyPowerFailures) { fail_often<Disk>(1, 2); }
TEST(LongForgetfulDisk, NoAcknowledgedKeyframeIsLostOrDoubledOverFiveHundredPowerFailures) {
  fail_often<Disk>(100, 20);
}

TEST(ForgetfulDisk, TheLossIsSeenWhenNothingIsSynced) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    Disk disk(seed, false);
    EXPECT_THAT(run_with_power_failures(disk, kFailures, seed, false).wrong,
                ContainsRegex("lost|acknowledged through|DATA_LOSS|verify"))
        << "seed " << seed;
  }
}

TEST(ForgetfulDisk, AnAcknowledgementBeforeItsSyncIsSeen) {
  Disk disk(1, false);
  EXPECT_THAT(run_with_power_failures(disk, 0, 1).wrong, ContainsRegex("acknowledged before its sync"));
}

}  // namespace
}  // namespace relmap::testing
