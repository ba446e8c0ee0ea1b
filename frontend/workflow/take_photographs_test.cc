#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstddef>
#include <opencv2/core.hpp>
#include <string>

#include "frontend/capture/testing/picture_files.h"
#include "frontend/console.h"
#include "frontend/workflow/testing/workflow_fixture.h"
#include "frontend/workflow/workflows.h"

namespace relmap::workflow {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

// A folder of six pictures.
class TakePhotographsTest : public WorkflowTest {
 protected:
  TakePhotographsTest() {
    options_.source = "images";
    options_.mono = true;
    options_.path = file("tower");
    for (int i = 0; i < kPictures; ++i) take(i);
  }
  std::string picture(int i) const { return file("tower/" + std::to_string(i) + ".png"); }

  void take(int i) const {
    cv::Mat texture = capture::testing_files::noise(320, 240, CV_8UC1, i);
    cv::normalize(texture, texture, 0, 255, cv::NORM_MINMAX);
    capture::testing_files::write_picture(picture(i), texture);
  }

  static constexpr int kPictures = 6;
};

TEST_F(TakePhotographsTest, EachPictureBecomesAKeyframe) {
  options_.quiet = false;
  options_.report = file("pictures.tsv");
  ASSERT_TRUE(run(take_photographs).ok());
  EXPECT_TRUE(summary_.mono);
  EXPECT_EQ(summary_.pairs, 6u);
  EXPECT_EQ(summary_.keyframes, 6u);
  ASSERT_EQ(daemon_.pushed.size(), 6u);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(daemon_.pushed[i].sequence, i);
    EXPECT_TRUE(daemon_.pushed[i].tracks.empty());
  }
  EXPECT_EQ(daemon_.pushed[0].session.name, "tower");
  EXPECT_THAT(daemon_.opened.at(0).recording, StartsWith("mono, "));
  EXPECT_TRUE(summary_.recording.has_value());
  const auto lines = lines_of(options_.report);
  ASSERT_EQ(lines.size(), 9u);
  EXPECT_THAT(lines[6], StartsWith("5\t5.png\t"));
  EXPECT_EQ(lines[7], "# keyframes\t6");
  EXPECT_THAT(said_, HasSubstr("6 of 6 pictures"));
  EXPECT_EQ(exit_code(), kDone);
  EXPECT_THAT(frontend::summary_json(summary_), HasSubstr("\"mono\":true,\"pairs\":6,"));
}

TEST_F(TakePhotographsTest, FailsOnAFolderWithoutPictures) {
  options_.path = file("nowhere");
  EXPECT_EQ(run(take_photographs).reason(), Reason::NO_SUCH_FILE);
  EXPECT_EQ(daemon_.opened.size(), 0u);
  EXPECT_EQ(exit_code(), kFailed);
}

TEST_F(TakePhotographsTest, NamesAPictureThatCannotBeRead) {
  capture::testing_files::write_text(picture(3), "no picture");
  ASSERT_TRUE(run(take_photographs).ok());
  EXPECT_EQ(summary_.keyframes, 5u);
  ASSERT_EQ(summary_.left_out.size(), 1u);
  EXPECT_EQ(summary_.unreadable.at(summary_.left_out[0].reason()), 1u);
  EXPECT_THAT(said_, HasSubstr("3.png"));
  EXPECT_EQ(exit_code(), kDone);
}

TEST_F(TakePhotographsTest, SaysWhyNoPictureBecameAKeyframe) {
  for (int i = 0; i < kPictures; ++i) {
    const cv::Mat grey(240, 320, CV_8UC1, cv::Scalar(90 + i));
    capture::testing_files::write_picture(picture(i), grey);
  }
  EXPECT_EQ(run(take_photographs).to_string(), "TOO_FEW_FEATURES: none of the 6 pictures became a keyframe");
  EXPECT_EQ(daemon_.pushed.size(), 0u);
  EXPECT_EQ(exit_code(), kFailed);
}

TEST_F(TakePhotographsTest, EndsInOrderWhenStopped) {
  for (int i = kPictures; i < 20; ++i) take(i);  // more than are described at once
  daemon_.pushed_one = [this](std::size_t count) { stop_ = stop_ || count == 2; };
  daemon_.takes_after_interrupt = true;
  options_.report = file("pictures.tsv");
  ASSERT_TRUE(run(take_photographs).ok());
  EXPECT_LT(daemon_.pushed.size(), 20u);
  EXPECT_EQ(daemon_.complete, false);
  EXPECT_EQ(lines_of(options_.report).at(daemon_.pushed.size() + 1),
            "# keyframes\t" + std::to_string(daemon_.pushed.size()));
  EXPECT_EQ(exit_code(), kInterrupted);
}

TEST_F(TakePhotographsTest, EndsWhenAKeyframeIsRefused) {
  daemon_.takes = 2;
  daemon_.refuses_to_push = {Reason::SESSION_DELETED, "by its operator"};
  EXPECT_EQ(run(take_photographs).reason(), Reason::SESSION_DELETED);
  EXPECT_EQ(summary_.keyframes, 2u);
  EXPECT_EQ(exit_code(), kFailed);
}

TEST_F(TakePhotographsTest, ContinuesAfterTheLastPictureOfAnInterruptedRun) {
  ASSERT_TRUE(run(take_photographs).ok());
  daemon_.last = daemon_.pushed.at(3);
  daemon_.pushed.clear();
  summary_ = {};
  ASSERT_TRUE(run(take_photographs).ok());
  ASSERT_EQ(daemon_.pushed.size(), 2u);
  EXPECT_EQ(daemon_.pushed[0].sequence, 4u);
  daemon_.last = daemon_.pushed.at(1);
  daemon_.pushed.clear();
  summary_ = {};
  EXPECT_TRUE(run(take_photographs).ok()) << "there is nothing more, which is no failure";
  EXPECT_EQ(daemon_.pushed.size(), 0u);
}

}  // namespace
}  // namespace relmap::workflow
