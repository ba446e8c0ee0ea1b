// No keyframe that was acknowledged is lost when the power fails, and none is doubled: through intake, journal and
// worker, on a disk that forgets what was not synced.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "storage/fault_engine.h"
#include "tests/support/power_failures.h"

namespace relmap::testing {
namespace {

using ::testing::ContainsRegex;

constexpr int kFailures = 20;

class Disk final : public FailingDisk {
 public:
  Disk(std::uint64_t seed, bool sync) : files_(ForgetfulFiles::create(seed, sync)) {}
  Result<std::shared_ptr<Engine>> open() override { return open_fault_engine(files_); }
  void fail_power_after(std::uint64_t operations) override { files_->fail_power_after(operations); }
  bool has_power() const override { return files_->has_power(); }
  void restart() override { files_->restart(); }

 private:
  const std::shared_ptr<ForgetfulFiles> files_;
};

TEST(ForgetfulDisk, NoAcknowledgedKeyframeIsLostOrDoubledOverTwentyPowerFailures) {
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    Disk disk(seed, true);
    const PowerFailureRun run = run_with_power_failures(disk, kFailures, seed);
    EXPECT_EQ(run.wrong, "");
    EXPECT_GT(run.acknowledged_at_failures, 20 * 20u) << "the failures came too early to tell anything";
    EXPECT_GT(run.commits, 5u);
    EXPECT_GT(run.closures_accepted, 0u);
  }
}

TEST(ForgetfulDisk, TheLossIsSeenWhenNothingIsSynced) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    Disk disk(seed, false);
    EXPECT_THAT(run_with_power_failures(disk, kFailures, seed).wrong,
                ContainsRegex("lost|acknowledged through|DATA_LOSS"))
        << "seed " << seed;
  }
}

}  // namespace
}  // namespace relmap::testing
