#include "frontend/workflow/pair_counts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "frontend/workflow/testing/fake_pairs.h"

namespace relmap::workflow {
namespace {

using ::testing::HasSubstr;

tracking::TrackedPair counted(bool tracked, bool both_came = true, bool repeated = false) {
  tracking::TrackedPair pair;
  pair.both_came = both_came;
  pair.report.tracked = tracked;
  pair.report.one_eye = !both_came;
  pair.report.repeated = repeated;
  pair.tracking_ms = 2;
  return pair;
}

class PairCountsTest : public ::testing::Test {
 protected:
  frontend::RunSummary summary_;
  PairCounts counts_{summary_};
  testing_pairs::FakePairs<> source_{testing_pairs::Script()};  // has twelve pairs
};

TEST_F(PairCountsTest, EachPairIsTrackedRepeatedOrLost) {
  counts_.add(counted(true));
  counts_.add(counted(true, false));
  counts_.add(counted(true, true, true));
  counts_.add(counted(false));
  EXPECT_EQ(summary_.pairs, 4u);
  EXPECT_EQ(summary_.tracked, 2u);
  EXPECT_EQ(summary_.repeated, 1u);
  EXPECT_EQ(summary_.lost, 1u);
  EXPECT_EQ(summary_.one_eyed, 1u);
  EXPECT_EQ(summary_.seen, 3u);
  EXPECT_EQ(summary_.measured, 1u);
  EXPECT_EQ(summary_.tracking_ms, 8);
}

TEST_F(PairCountsTest, CountsPairsLeftOutForTheirStampSeparately) {
  tracking::PipelineSummary done;
  done.refused = {{Reason::TIME_AHEAD, 1}, {Reason::TIME_BACKWARDS, 2}, {Reason::PICTURE_DAMAGED, 3}};
  done.dropped = 4;
  counts_.add(done);
  EXPECT_EQ(summary_.stamps_refused.size(), 2u);
  EXPECT_EQ(summary_.unreadable.at(Reason::PICTURE_DAMAGED), 3u);
  EXPECT_EQ(summary_.dropped, 4u);
}

TEST_F(PairCountsTest, ExpectsAllPairsOfARecordingReadToItsEnd) {
  counts_.expect(source_, 1, true);
  EXPECT_EQ(summary_.expected, 12u);
  counts_.expect(source_, 5, true);
  EXPECT_EQ(summary_.expected, 3u) << "pairs 0, 5 and 10";
  summary_.dropped = 2;
  counts_.expect(source_, 5, true);
  EXPECT_EQ(summary_.expected, 1u) << "what was dropped to keep up is not missing";
}

TEST_F(PairCountsTest, ExpectsThePairsThatARunReachedIfItEndedEarly) {
  counts_.add(counted(true));
  counts_.add(counted(true, false));
  tracking::PipelineSummary done;
  done.refused = {{Reason::NO_SUCH_FILE, 3}};  // one of them is the other eye of the second pair
  counts_.add(done);
  counts_.expect(source_, 1, false);
  EXPECT_EQ(summary_.expected, 4u);
}

TEST_F(PairCountsTest, ExplainsThatNothingIsTrackedByAFaultyRig) {
  summary_.pairs = 12;
  EXPECT_EQ(
      untracked(summary_, "none of ").to_string(),
      "TOO_FEW_FEATURES: none of 12 pairs could be tracked from the one before it; --show DIR draws what is seen");
  summary_.rig.emplace();
  summary_.rig->wrong = true;
  summary_.rig->findings = {{Reason::ROWS_APART, "by 3 px"}};
  EXPECT_EQ(untracked(summary_, "none of ").reason(), Reason::ROWS_APART);
  EXPECT_THAT(untracked(summary_, "none of ").message(), HasSubstr("from the one before it: by 3 px; what helps: "));
}

}  // namespace
}  // namespace relmap::workflow
