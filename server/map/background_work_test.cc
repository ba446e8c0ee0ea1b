#include "server/map/background_work.h"

#include <gtest/gtest.h>

#include <map>
#include <set>
#include <variant>
#include <vector>

namespace relmap::map {
namespace {

class BackgroundWorkTest : public ::testing::Test {
 protected:
  void add_session(SessionNumber number, std::uint32_t frames) {
    storage::Session session;
    session.number = number;
    session.state = storage::SessionState::kDeleting;
    session.frames = frames;
    session.last = frames == 0 ? 0 : frames - 1;
    sessions_[number] = session;
  }
  template <typename Record>
  std::size_t submitted() const {
    std::size_t count = 0;
    for (const auto& [record, done] : submitted_) count += std::holds_alternative<Record>(record);
    return count;
  }

  std::map<SessionNumber, storage::Session> sessions_;
  std::set<SessionNumber> looked_up_;
  std::vector<SessionNumber> gone_;
  bool may_remove_ = true, quiet_ = true, lookups_keep_up_ = true;
  Status queue_takes_;
  std::vector<std::pair<storage::JournalRecord, BackgroundWork::Done>> submitted_;
  BackgroundWork work_{1000,
                       {.submit =
                            [this](storage::JournalRecord record, BackgroundWork::Done done) {
                              if (queue_takes_.ok()) submitted_.emplace_back(std::move(record), std::move(done));
                              return queue_takes_;
                            },
                        .is_quiet = [this] { return quiet_; },
                        .lookups_keep_up = [this] { return lookups_keep_up_; },
                        .session = [this](SessionNumber number) { return std::optional(sessions_.at(number)); },
                        .has_waiting_lookups = [this](SessionNumber number) { return looked_up_.contains(number); },
                        .may_remove = [this] { return may_remove_; },
                        .on_gone = [this](SessionNumber number) { gone_.push_back(number); }}};
};

TEST_F(BackgroundWorkTest, AtMostOneRelaxationRecordIsSubmitted) {
  EXPECT_TRUE(work_.done());
  work_.resume(true);
  EXPECT_FALSE(work_.done());
  work_.submit_next();
  work_.submit_next();
  EXPECT_EQ(1u, submitted<storage::IdleWorkRecord>());
  work_.applied(submitted_.back().first, true);
  work_.submit_next();
  EXPECT_EQ(2u, submitted<storage::IdleWorkRecord>());
  work_.applied(submitted_.back().first, false);
  EXPECT_TRUE(work_.done());
  work_.submit_next();
  EXPECT_EQ(2u, submitted<storage::IdleWorkRecord>());
}

TEST_F(BackgroundWorkTest, RecordsFromOutsideGoFirst) {
  add_session(3, 10);
  work_.delete_session(3);
  work_.resume(true);
  quiet_ = false;
  work_.submit_next();
  EXPECT_TRUE(submitted_.empty());
  quiet_ = true;
  work_.submit_next();
  EXPECT_EQ(2u, submitted_.size());
}

TEST_F(BackgroundWorkTest, RelaxationWaitsForLookupsThatHaveFallenBehindAndRemovalDoesNot) {
  add_session(3, 10);
  work_.delete_session(3);
  work_.resume(true);
  lookups_keep_up_ = false;
  work_.submit_next();
  EXPECT_EQ(1u, submitted<storage::IdleWorkRecord>()) << "the first has waited long enough";
  work_.applied(submitted_.front().first, true);
  EXPECT_TRUE(work_.relaxation_waits());
  work_.submit_next();
  EXPECT_EQ(1u, submitted<storage::IdleWorkRecord>());
  EXPECT_EQ(1u, submitted<storage::RemoveChunkRecord>());
  EXPECT_TRUE(work_.relaxation_waits());
  lookups_keep_up_ = true;
  work_.submit_next();
  EXPECT_EQ(2u, submitted<storage::IdleWorkRecord>());
  EXPECT_FALSE(work_.relaxation_waits());
}

TEST_F(BackgroundWorkTest, RefusedRecordsAreSubmittedAgain) {
  work_.resume(true);
  queue_takes_ = Status(Reason::BUDGET_EXCEEDED, "the queue is full");
  work_.submit_next();
  queue_takes_ = Status();
  work_.submit_next();
  ASSERT_EQ(1u, submitted<storage::IdleWorkRecord>());
  submitted_.back().second(Status(Reason::DISK_FULL, "no room"));
  work_.submit_next();
  EXPECT_EQ(2u, submitted<storage::IdleWorkRecord>());
}

TEST_F(BackgroundWorkTest, SessionsAreRemovedInTurnChunkByChunk) {
  add_session(3, 70);
  add_session(5, 10);
  work_.delete_session(5);
  work_.delete_session(3);
  work_.submit_next();
  work_.submit_next();
  ASSERT_EQ(1u, submitted<storage::RemoveChunkRecord>());
  EXPECT_EQ(3u, std::get<storage::RemoveChunkRecord>(submitted_.back().first).session);
  add_session(3, 64);
  work_.applied(submitted_.back().first, false);
  work_.submit_next();
  EXPECT_EQ(2u, submitted<storage::RemoveChunkRecord>());
  add_session(3, 0);
  work_.applied(submitted_.back().first, false);
  work_.submit_next();
  EXPECT_EQ(std::vector<SessionNumber>{3}, gone_);
  EXPECT_EQ(5u, std::get<storage::RemoveChunkRecord>(submitted_.back().first).session);
  EXPECT_FALSE(work_.done());
  add_session(5, 0);
  work_.applied(submitted_.back().first, false);
  EXPECT_FALSE(work_.next_removal());
  EXPECT_TRUE(work_.done());
}

TEST_F(BackgroundWorkTest, RemovalWaitsForPermissionAndForLookups) {
  add_session(3, 10);
  work_.delete_session(3);
  looked_up_ = {3};
  EXPECT_FALSE(work_.next_removal());
  looked_up_ = {};
  may_remove_ = false;
  EXPECT_FALSE(work_.next_removal());
  may_remove_ = true;
  EXPECT_TRUE(work_.next_removal());
  EXPECT_FALSE(work_.done());
}

}  // namespace
}  // namespace relmap::map
