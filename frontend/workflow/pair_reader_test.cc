#include "frontend/workflow/pair_reader.h"

#include <gtest/gtest.h>

#include <vector>

#include "frontend/workflow/testing/workflow_fixture.h"

namespace relmap::workflow {
namespace {

class PairReaderTest : public WorkflowTest {
 protected:
  // Returns the indices of all pairs, with -1 for a pair that cannot be read.
  std::vector<int> read_all(PairReader& reader) {
    std::vector<int> read;
    for (;;) {
      const auto pair = reader.next();
      if (pair.ok() && !pair->has_value()) return read;
      read.push_back(pair.ok() ? static_cast<int>((*pair)->index) : -1);
    }
  }
  std::int64_t time_of(std::size_t i) const { return script_.pairs[i]->time_us; }

  workflow::Run run_{options_, outside_, stop_, summary_, waits_};
};

TEST_F(PairReaderTest, GivesEveryNthPair) {
  options_.every = 5;
  testing_pairs::FakePairs<> source(script_);
  PairReader reader(run_, source);
  int seen = 0;
  reader.show_to([&](const capture::StereoFrame&) { ++seen; });
  EXPECT_EQ(read_all(reader), (std::vector<int>{0, 5, 10}));
  EXPECT_EQ(seen, 3);
}

TEST_F(PairReaderTest, ContinuesAfterAPairThatCannotBeRead) {
  script_.pairs[1] = Status(Reason::PICTURE_DAMAGED, "1.png");
  script_.pairs.resize(3, Status(Reason::CORRUPT, ""));
  testing_pairs::FakePairs<> source(script_);
  PairReader reader(run_, source);
  EXPECT_EQ(read_all(reader), (std::vector<int>{0, -1, 2}));
}

TEST_F(PairReaderTest, EndsWhenTheRunIsToStop) {
  script_.before = [&](std::size_t i) { stop_ = i == 3; };
  testing_pairs::FakePairs<> source(script_);
  PairReader reader(run_, source);
  EXPECT_EQ(read_all(reader), (std::vector<int>{0, 1, 2, 3}));
}

TEST_F(PairReaderTest, BeginsAtTheLastKeyframeOfAnInterruptedRun) {
  testing_pairs::FakePairs<> source(script_);
  PairReader reader(run_, source);
  tracking::StampFilter stamps = reader.go_on_at(time_of(9));
  EXPECT_EQ(read_all(reader), (std::vector<int>{9, 10, 11}));
  EXPECT_EQ(stamps.admit(time_of(9)).or_throw(), time_of(9));
}

TEST_F(PairReaderTest, FindsTheLastKeyframeBehindAClockThatWasSet) {
  const std::int64_t hour = 3'600'000'000;
  script_.stamps_rise = false;
  for (std::size_t i = 4; i < script_.pairs.size(); ++i) script_.pairs[i]->time_us -= hour;
  testing_pairs::FakePairs<> whole(script_), rest(script_);
  // The filtered stamps of all pairs, when none is passed over.
  std::vector<std::pair<int, std::int64_t>> admitted;
  PairReader all(run_, whole);
  tracking::StampFilter from_the_start;
  for (auto pair = all.next(); pair->has_value(); pair = all.next())
    if (const auto time_us = from_the_start.admit((*pair)->time_us); time_us.ok())
      admitted.emplace_back(static_cast<int>((*pair)->index), *time_us);
  ASSERT_GE(admitted.size(), 6u);
  const auto& [last, last_us] = admitted[admitted.size() - 2];

  PairReader reader(run_, rest);
  tracking::StampFilter stamps = reader.go_on_at(last_us);
  const auto pair = reader.next();
  ASSERT_TRUE(pair.ok() && pair->has_value());
  EXPECT_EQ(static_cast<int>((*pair)->index), last);
  EXPECT_EQ(stamps.admit((*pair)->time_us).or_throw(), last_us);
}

}  // namespace
}  // namespace relmap::workflow
