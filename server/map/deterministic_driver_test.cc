#include "server/map/deterministic_driver.h"

#include <gtest/gtest.h>

#include <variant>
#include <vector>

namespace relmap::map {
namespace {

class DeterministicDriverTest : public ::testing::Test {
 protected:
  template <typename Record>
  std::size_t applied() const {
    std::size_t count = 0;
    for (const storage::JournalRecord& record : applied_) count += std::holds_alternative<Record>(record);
    return count;
  }

  int takes_ = 1000;     // records that the disk takes yet
  int slices_left_ = 0;  // of relaxation
  int chunks_left_ = 0;
  std::vector<storage::JournalRecord> found_;
  Status look_up_fails_;
  std::vector<storage::JournalRecord> applied_;
  std::uint64_t sequence_ = 10;
  LookupQueue lookups_{std::make_shared<storage::Budget>(std::size_t{64} << 20)};
  DeterministicDriver driver_{
      1000,
      lookups_,
      {.append =
           [this](const storage::JournalRecord&) { return takes_-- > 0 ? std::optional(++sequence_) : std::nullopt; },
       .apply =
           [this](std::uint64_t sequence, const storage::JournalRecord& record) {
             EXPECT_EQ(sequence_, sequence);
             if (std::holds_alternative<storage::IdleWorkRecord>(record)) --slices_left_;
             if (std::holds_alternative<storage::RemoveChunkRecord>(record)) --chunks_left_;
             applied_.push_back(record);
           },
       .look_up =
           [this](FrameId) {
             if (!look_up_fails_.ok()) throw StatusError(look_up_fails_);
             return found_;
           },
       .relaxation_pending = [this] { return slices_left_ > 0; },
       .next_removal =
           [this] { return chunks_left_ > 0 ? std::optional(storage::RemoveChunkRecord{}) : std::nullopt; }}};
};

TEST_F(DeterministicDriverTest, LookupRelaxationAndRemovalFollowInThisOrder) {
  found_ = {storage::SetLabelRecord{{1, 3}, "found", true}};
  slices_left_ = 2;
  chunks_left_ = 1;
  const auto outcome = driver_.follow_up(10, FrameId{1, 3});
  EXPECT_TRUE(outcome.trouble.ok());
  EXPECT_EQ(14u, outcome.last);
  ASSERT_EQ(4u, applied_.size());
  EXPECT_TRUE(std::holds_alternative<storage::SetLabelRecord>(applied_[0]));
  EXPECT_TRUE(std::holds_alternative<storage::IdleWorkRecord>(applied_[2]));
  EXPECT_TRUE(std::holds_alternative<storage::RemoveChunkRecord>(applied_[3]));
  EXPECT_TRUE(lookups_.open_frames().empty());
}

TEST_F(DeterministicDriverTest, RelaxationIsBounded) {
  slices_left_ = 1000;
  driver_.follow_up(10, std::nullopt);
  EXPECT_EQ(std::size_t{DeterministicDriver::kSlices}, applied<storage::IdleWorkRecord>());
  applied_.clear();
  driver_.follow_up(sequence_, std::nullopt, 0);
  EXPECT_TRUE(applied_.empty());
}

// The next start takes it up again.
TEST_F(DeterministicDriverTest, ALookupThatIsNotJournalledStaysOpen) {
  found_ = {storage::SetLabelRecord{{1, 3}, "found", true}};
  takes_ = 0;
  const auto outcome = driver_.follow_up(10, FrameId{1, 3});
  EXPECT_TRUE(outcome.trouble.ok());
  EXPECT_EQ(10u, outcome.last);
  EXPECT_TRUE(lookups_.is_open({1, 3}));
}

TEST_F(DeterministicDriverTest, AFailureIsReportedWithTheLastAppliedSequence) {
  look_up_fails_ = Status(Reason::IO_ERROR, "the disk");
  const auto outcome = driver_.follow_up(10, FrameId{1, 3});
  EXPECT_EQ(Reason::IO_ERROR, outcome.trouble.reason());
  EXPECT_EQ(10u, outcome.last);
  EXPECT_TRUE(lookups_.is_open({1, 3}));
}

}  // namespace
}  // namespace relmap::map
