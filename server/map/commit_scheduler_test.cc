#include "server/map/commit_scheduler.h"

#include <gtest/gtest.h>

#include <atomic>
#include <vector>

#include "storage/testing/fault_engine.h"
#include "storage/testing/forgetful_files.h"

namespace relmap::map {
namespace {

using namespace std::chrono_literals;

class CommitSchedulerTest : public ::testing::Test {
 protected:
  CommitSchedulerTest() {
    map_ = storage::Map::open(engine_, engine_->acquire().or_throw(), budget_).or_throw();
    commits_.open(*map_);
  }
  void edit() { ++map_->state().keyframes; }

  const std::shared_ptr<storage::Faults> faults_ = std::make_shared<storage::Faults>();
  const std::shared_ptr<storage::Engine> engine_ =
      storage::open_fault_engine(storage::ForgetfulFiles::create(1), faults_).or_throw();
  const std::shared_ptr<storage::Budget> budget_ = std::make_shared<storage::Budget>(std::size_t{64} << 20);
  std::vector<Status> outcomes_;
  std::atomic<int> changes_ = 0;
  std::set<FrameId> open_ = {{1, 4}};
  CommitScheduler commits_{1h,
                           engine_,
                           budget_,
                           {.open_lookups = [this] { return open_; },
                            .on_outcome = [this](const Status& outcome) { outcomes_.push_back(outcome); },
                            .on_wait = [this](bool waiting) { waits_ += waiting ? 1 : -1; },
                            .on_change = [this] {  // would not return if it were called with the lock held
                              commits_.wants_worker();
                              ++changes_;
                            }}};
  int waits_ = 0;
  std::unique_ptr<storage::Map> map_;
};

TEST_F(CommitSchedulerTest, ATicketIsDoneOnceEverythingIsCommitted) {
  edit();
  EXPECT_FALSE(commits_.wants_worker());
  const std::uint64_t ticket = commits_.ask();
  EXPECT_EQ(1, changes_) << "the worker wakes";
  EXPECT_TRUE(commits_.wants_worker());
  EXPECT_FALSE(commits_.done(ticket));
  commits_.run();
  EXPECT_GE(changes_, 2) << "and so does who asked";
  EXPECT_TRUE(commits_.done(ticket));
  EXPECT_FALSE(commits_.wants_worker());
  ASSERT_EQ(1u, outcomes_.size());
  EXPECT_TRUE(outcomes_.back().ok());
  EXPECT_EQ(open_, map_->state().lookups) << "they are written down with it";
}

TEST_F(CommitSchedulerTest, NothingIsDueBeforeTheIntervalUnlessMuchIsDirty) {
  edit();
  commits_.run();
  EXPECT_TRUE(outcomes_.empty());
  EXPECT_GT(commits_.next_due(), CommitScheduler::Clock::now() + 30min);
}

TEST_F(CommitSchedulerTest, AFailedCommitIsReportedAndRepeated) {
  edit();
  faults_->commits = 1;
  commits_.commit();
  ASSERT_FALSE(outcomes_.empty());
  EXPECT_EQ(Reason::IO_ERROR, outcomes_.back().reason());
  EXPECT_TRUE(commits_.failing());
  const std::uint64_t ticket = commits_.ask();
  commits_.run();
  EXPECT_TRUE(commits_.done(ticket));
  EXPECT_TRUE(outcomes_.back().ok());
  EXPECT_FALSE(commits_.failing());
}

TEST_F(CommitSchedulerTest, AClosedSchedulerCommitsNothingButCompletesTickets) {
  edit();
  commits_.close();
  const std::uint64_t ticket = commits_.ask();
  commits_.run();
  EXPECT_TRUE(commits_.done(ticket));
  EXPECT_TRUE(outcomes_.empty());
  EXPECT_EQ(0u, engine_->applied_sequence());
}

}  // namespace
}  // namespace relmap::map
