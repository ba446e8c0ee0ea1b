#include "frontend/workflow/pair_outputs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "frontend/capture/testing/file_size_limit.h"
#include "frontend/tracking/pair.h"
#include "frontend/workflow/testing/workflow_fixture.h"

namespace relmap::workflow {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class PairOutputsTest : public WorkflowTest {
 protected:
  PairOutputsTest() {
    options_.report = file("pairs.tsv");
    options_.show = file("tracks");
  }
  static tracking::TrackedPair tracked(std::uint64_t index) {
    auto pair = std::make_shared<tracking::Pair>();
    pair->picture = vision::copy_of(testing_pairs::street()[0].left);
    tracking::TrackedPair result;
    result.pair = std::move(pair);
    result.index = index;
    result.picture = std::to_string(index) + ".png";
    result.report.tracked = true;
    return result;
  }
  // Opens the outputs, adds pairs and closes them.
  Status write(const std::vector<std::uint64_t>& indices, bool goes_on = false) {
    auto outputs = PairOutputs::open(options_, goes_on);
    if (!outputs.ok()) return outputs.status();
    for (const std::uint64_t index : indices)
      if (Status status = outputs->add(tracked(index)); !status.ok()) return status;
    return outputs->close();
  }
  std::vector<std::string> pictures() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(options_.show)) names.push_back(entry.path().filename());
    std::sort(names.begin(), names.end());
    return names;
  }
};

TEST_F(PairOutputsTest, EachPairIsALineOfTheReportAndAPictureOfTheFolder) {
  ASSERT_TRUE(write({4, 7}).ok());
  const auto lines = lines_of(options_.report);
  ASSERT_GE(lines.size(), 4u);
  EXPECT_THAT(lines[0], StartsWith("pair\tpicture\t"));
  EXPECT_THAT(lines[1], StartsWith("4\t4.png\t"));
  EXPECT_THAT(lines[2], StartsWith("7\t7.png\t"));
  EXPECT_EQ(lines[3], "# pairs\t2");
  EXPECT_THAT(pictures(), ElementsAre("000004.png", "000007.png"));
}

TEST_F(PairOutputsTest, EachIsWrittenWithoutTheOther) {
  const std::string report = std::exchange(options_.report, "");
  ASSERT_TRUE(write({0}).ok());
  EXPECT_THAT(pictures(), ElementsAre("000000.png"));
  options_.report = report;
  options_.show.clear();
  ASSERT_TRUE(write({1}).ok());
  EXPECT_THAT(lines_of(report).at(1), StartsWith("1\t"));
  options_.report.clear();
  EXPECT_TRUE(write({2}).ok()) << "nothing is asked for";
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_.path()), {}), 2) << "and nothing else is written";
}

TEST_F(PairOutputsTest, ALineIsOnTheDiskBeforeTheOutputsAreClosed) {
  auto outputs = PairOutputs::open(options_, false).or_throw();
  ASSERT_TRUE(outputs.add(tracked(0)).ok());
  EXPECT_THAT(lines_of(options_.report).at(1), StartsWith("0\t0.png\t"));
  EXPECT_THAT(pictures(), ElementsAre("000000.png"));
  EXPECT_TRUE(outputs.close().ok());
}

TEST_F(PairOutputsTest, AContinuedRunIsAppendedToItsOutputs) {
  ASSERT_TRUE(write({0, 1}).ok());
  const auto before = lines_of(options_.report);
  ASSERT_TRUE(write({2}, true).ok());
  auto after = lines_of(options_.report);
  ASSERT_GT(after.size(), before.size() + 1);
  EXPECT_THAT(after[before.size()], StartsWith("2\t2.png\t")) << "without a second line of names";
  after.resize(before.size());
  EXPECT_EQ(after, before);
  EXPECT_THAT(pictures(), ElementsAre("000000.png", "000001.png", "000002.png"));
}

TEST_F(PairOutputsTest, ANewRunReplacesTheReport) {
  ASSERT_TRUE(write({0, 1}).ok());
  fs::remove_all(options_.show);
  ASSERT_TRUE(write({5}).ok());
  EXPECT_THAT(lines_of(options_.report).at(1), StartsWith("5\t"));
  EXPECT_EQ(lines_of(options_.report).at(2), "# pairs\t1");
}

TEST_F(PairOutputsTest, ARunThatCannotShowItsPairsLeavesAnEarlierReportAsItIs) {
  ASSERT_TRUE(write({0}).ok());
  const auto before = lines_of(options_.report);
  EXPECT_EQ(write({1}).reason(), Reason::INVALID_ARGUMENT) << "the folder has pictures of another run";
  EXPECT_EQ(lines_of(options_.report), before);
  options_.show = file("tracks.avi");
  EXPECT_EQ(write({1}).reason(), Reason::UNSUPPORTED);
  EXPECT_EQ(lines_of(options_.report), before);
}

TEST_F(PairOutputsTest, AReportThatCannotBeOpenedIsAnError) {
  options_.report = file("no such folder") + "/pairs.tsv";
  EXPECT_EQ(write({0}).reason(), Reason::IO_ERROR);
  options_.report = file("notes.txt");
  std::ofstream(options_.report) << "not a report\n";
  EXPECT_EQ(write({0}).reason(), Reason::INVALID_ARGUMENT);
  EXPECT_THAT(lines_of(options_.report), ElementsAre("not a report"));
}

TEST_F(PairOutputsTest, APictureThatCannotBeWrittenIsAnErrorAndItsLineIsInTheReport) {
  auto outputs = PairOutputs::open(options_, false).or_throw();
  fs::remove_all(options_.show);
  const Status shown = outputs.add(tracked(3));
  EXPECT_EQ(shown.reason(), Reason::IO_ERROR);
  EXPECT_THAT(shown.message(), HasSubstr("000003.png"));
  EXPECT_TRUE(outputs.close().ok());
  EXPECT_THAT(lines_of(options_.report).at(1), StartsWith("3\t"));
}

TEST_F(PairOutputsTest, AReportThatIsNotCompleteIsAnErrorOfClosing) {
  options_.show.clear();
  const capture::testing_files::FileSizeLimit full_disk(64);
  const Status written = write({0});
  EXPECT_EQ(written.to_string(), "IO_ERROR: " + options_.report + " is not complete");
}

}  // namespace
}  // namespace relmap::workflow
