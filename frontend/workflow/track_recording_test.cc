#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>

#include "frontend/console.h"
#include "frontend/workflow/testing/workflow_fixture.h"
#include "frontend/workflow/workflows.h"

namespace relmap::workflow {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

class TrackRecordingTest : public WorkflowTest {
 protected:
  // A pair of pictures without texture. No two pairs are alike.
  static capture::StereoFrame blank(std::size_t i) {
    capture::StereoFrame pair = testing_pairs::street()[i];
    for (vision::Image* eye : {&pair.left, &pair.right})
      for (int y = 0; y < eye->height(); ++y)
        std::fill_n(eye->row(y), eye->width(), static_cast<std::uint8_t>(60 + 5 * i));
    return pair;
  }
};

TEST_F(TrackRecordingTest, EveryPairIsTrackedAndItsKeyframesAreSent) {
  options_.quiet = false;
  ASSERT_TRUE(run(track_recording).ok());
  EXPECT_EQ(summary_.pairs, 12u);
  EXPECT_EQ(summary_.tracked, 12u);
  EXPECT_EQ(summary_.expected, 12u);
  EXPECT_GE(summary_.keyframes, 2u);
  EXPECT_EQ(daemon_.pushed.size(), summary_.keyframes);
  EXPECT_EQ(daemon_.pushed[0].session.name, "street") << "of its path";
  EXPECT_EQ(daemon_.pushed[0].session.camera, testing_pairs::kDriveCamera);
  EXPECT_EQ(daemon_.opened.at(0).recording, "street, no pictures");
  EXPECT_EQ(daemon_.complete, true);
  EXPECT_TRUE(summary_.recording.has_value());
  EXPECT_TRUE(summary_.rig.has_value());
  EXPECT_GT(summary_.path_m, 1);
  EXPECT_THAT(said_, StartsWith("a street\n"));
  EXPECT_THAT(said_, HasSubstr("12 of 12 pairs"));
  EXPECT_EQ(exit_code(), kDone);
  EXPECT_THAT(frontend::summary_json(summary_), HasSubstr("\"error\":null"));
}

TEST_F(TrackRecordingTest, WritesALineForEachPairToTheReport) {
  options_.report = file("pairs.tsv");
  options_.show = file("tracks");
  ASSERT_TRUE(run(track_recording).ok());
  const auto lines = lines_of(options_.report);
  ASSERT_GT(lines.size(), 13u);
  EXPECT_THAT(lines[0], StartsWith("pair\tpicture\t"));
  EXPECT_THAT(lines[12], StartsWith("11\t11.png\t"));
  EXPECT_EQ(lines[13], "# pairs\t12");
  EXPECT_TRUE(std::filesystem::exists(file("tracks/000011.png")));
}

TEST_F(TrackRecordingTest, FailsIfTheReportCannotBeWritten) {
  options_.report = file("no such folder") + "/pairs.tsv";
  EXPECT_EQ(run(track_recording).reason(), Reason::IO_ERROR);
  EXPECT_EQ(summary_.pairs, 0u);
  EXPECT_EQ(exit_code(), kFailed);
}

TEST_F(TrackRecordingTest, FailsIfTheRecordingCannotBeOpened) {
  no_recording_ = {Reason::NO_CALIBRATION, "there is none"};
  EXPECT_EQ(run(track_recording).to_string(), "NO_CALIBRATION: there is none");
  EXPECT_EQ(daemon_.opened.size(), 0u);
  EXPECT_EQ(exit_code(), kFailed);
  EXPECT_THAT(frontend::summary_json(summary_),
              HasSubstr("\"error\":{\"reason\":\"NO_CALIBRATION\",\"message\":\"there is none\"}"));
}

TEST_F(TrackRecordingTest, NamesPairsThatCannotBeRead) {
  script_.pairs[3] = Status(Reason::PICTURE_DAMAGED, "3.png is cut off");
  script_.pairs[7]->right = vision::Image();
  script_.pairs[7]->eye_missing = {Reason::NO_SUCH_FILE, "7.png of the right eye"};
  script_.pairs[9]->time_us -= 60'000'000;
  ASSERT_TRUE(run(track_recording).ok());
  EXPECT_EQ(summary_.pairs, 10u);
  EXPECT_EQ(summary_.one_eyed, 1u);
  EXPECT_EQ(summary_.unreadable.at(Reason::PICTURE_DAMAGED), 1u);
  EXPECT_EQ(summary_.unreadable.at(Reason::NO_SUCH_FILE), 1u);
  EXPECT_EQ(summary_.stamps_refused.at(Reason::TIME_BACKWARDS), 1u);
  EXPECT_EQ(summary_.left_out.size(), 3u);
  EXPECT_THAT(said_, HasSubstr("PICTURE_DAMAGED: 3.png is cut off\n"));
  EXPECT_EQ(exit_code(), kUntrusted) << "9 of 12 were measured";
}

TEST_F(TrackRecordingTest, ASourceThatFailsForGoodIsNotTrusted) {
  for (std::size_t i = 4; i < script_.pairs.size(); ++i) script_.pairs[i] = Status(Reason::IO_ERROR, "a broken disk");
  ASSERT_TRUE(run(track_recording).ok());
  EXPECT_EQ(summary_.pairs, 4u);
  EXPECT_EQ(summary_.expected, 12u);
  EXPECT_EQ(summary_.unreadable.at(Reason::IO_ERROR), 8u);
  EXPECT_EQ(exit_code(), kUntrusted);
  EXPECT_THAT(frontend::summary_text(summary_), StartsWith("NOT TO BE TRUSTED\n"));
}

TEST_F(TrackRecordingTest, EndsInOrderWhenStopped) {
  script_.before = [&](std::size_t i) {
    if (i == 6) stop_ = true;
  };
  options_.report = file("pairs.tsv");
  ASSERT_TRUE(run(track_recording).ok());
  EXPECT_LE(summary_.pairs, 7u);
  EXPECT_EQ(daemon_.complete, false) << "there is more to read";
  EXPECT_EQ(daemon_.patience, 0);
  EXPECT_EQ(daemon_.ends, 0);
  EXPECT_TRUE(daemon_.interrupted);
  EXPECT_EQ(lines_of(options_.report).at(summary_.pairs + 1), "# pairs\t" + std::to_string(summary_.pairs));
  EXPECT_EQ(exit_code(), kInterrupted);
  EXPECT_THAT(frontend::summary_json(summary_), HasSubstr("\"interrupted\":true"));
}

TEST_F(TrackRecordingTest, AStopBeforeItsFirstPairSendsNothing) {
  stop_ = true;
  ASSERT_TRUE(run(track_recording).ok());
  EXPECT_EQ(daemon_.pushed.size(), 0u);
  EXPECT_EQ(exit_code(), kInterrupted);
}

TEST_F(TrackRecordingTest, EndsWhenAKeyframeIsRefused) {
  daemon_.takes = 1;
  daemon_.refuses_to_push = {Reason::SEQUENCE_CONFLICT, "other keyframes under that uuid"};
  options_.all_keyframes = true;
  EXPECT_EQ(run(track_recording).reason(), Reason::SEQUENCE_CONFLICT);
  EXPECT_EQ(summary_.keyframes, 1u);
  EXPECT_FALSE(daemon_.complete.has_value()) << "nothing is waited for";
  EXPECT_EQ(exit_code(), kFailed);
}

TEST_F(TrackRecordingTest, RefusesAFaultyRigBeforeAnythingIsSent) {
  for (auto& pair : script_.pairs) std::swap(pair->left, pair->right);
  const Status status = run(track_recording);
  EXPECT_EQ(status.reason(), Reason::NOT_STEREO);
  EXPECT_THAT(status.message(), HasSubstr("exchanged"));
  EXPECT_THAT(status.message(), ::testing::EndsWith("; --despite-check tracks it all the same"));
  EXPECT_EQ(daemon_.opened.size(), 0u);
  EXPECT_EQ(exit_code(), kFailed);
}

TEST_F(TrackRecordingTest, RefusesASourceWithOneEye) {
  script_.one_eye = true;
  const Status status = run(track_recording);
  EXPECT_EQ(status.reason(), Reason::NOT_STEREO);
  EXPECT_THAT(status.message(), HasSubstr("; --source images --mono makes places of its pictures"));
  EXPECT_EQ(daemon_.opened.size(), 0u);
}

TEST_F(TrackRecordingTest, SendsNothingOfARecordingThatCannotBeTracked) {
  for (std::size_t i = 0; i < script_.pairs.size(); ++i) script_.pairs[i] = blank(i);
  const Status status = run(track_recording);
  EXPECT_FALSE(status.ok());
  EXPECT_THAT(status.message(), StartsWith("none of "));
  EXPECT_EQ(daemon_.pushed.size(), 0u);
  EXPECT_EQ(daemon_.complete, false);
  EXPECT_EQ(exit_code(), kFailed);
}

TEST_F(TrackRecordingTest, SendsASinglePair) {
  script_.pairs.resize(1, script_.pairs[0]);
  ASSERT_TRUE(run(track_recording).ok());
  EXPECT_EQ(daemon_.pushed.size(), 1u);
}

TEST_F(TrackRecordingTest, ContinuesAfterTheLastKeyframeOfAnInterruptedRun) {
  options_.all_keyframes = true;
  ASSERT_TRUE(run(track_recording).ok());
  const auto whole = daemon_.pushed;
  ASSERT_EQ(whole.size(), 12u);
  daemon_.last = whole[7];
  daemon_.pushed.clear();
  summary_ = {};
  ASSERT_TRUE(run(track_recording).ok());
  EXPECT_EQ(summary_.gone_on, 7u);
  ASSERT_FALSE(daemon_.pushed.empty());
  EXPECT_EQ(daemon_.pushed.front().sequence, 8u);
  EXPECT_EQ(daemon_.pushed.front().time_us, whole[8].time_us);
  EXPECT_EQ(summary_.expected, summary_.pairs) << "of what it came to";
}

}  // namespace
}  // namespace relmap::workflow
