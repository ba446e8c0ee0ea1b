// Pictures that a user asks about with the program: their eye, their camera, the session that is returned, and
// refusals.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "proto/calibration/calibration.h"
#include "storage/testing/temporary_folder.h"
#include "tests/support/localised.h"
#include "tests/support/process.h"
#include "tests/support/running_daemon.h"
#include "tests/support/simulated_recording.h"

namespace relmap::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

constexpr int kPairs = 40;
constexpr int kAsked = 21;

// A rendered drive in a map.
class PictureQuestions : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    recorded_ = new storage::TemporaryFolder();
    record_simulation(drive(), {"--seed", "3", "--pairs", std::to_string(kPairs), "--laps", "0.16"});
  }
  static void TearDownTestSuite() {
    delete recorded_;
    recorded_ = nullptr;
  }
  void SetUp() override {
    setenv("XDG_STATE_HOME", (folder_ / "state").c_str(), 1);
    options_.data = folder_ / "map";
    daemon_ = std::make_unique<RunningDaemon>(options_);
  }

  static std::string drive() { return *recorded_ / "drive"; }
  static std::string picture(int pair, const std::string& eye = "image_0") {
    return drive() + "/" + eye + "/" + picture_name(pair);
  }
  std::string file(const std::string& name) const {
    fs::create_directories(fs::path(folder_ / name).parent_path());
    return folder_ / name;
  }

  Finished relmap(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {built_program("relmap"), "--server", options_.data});
    return run_program(arguments);
  }
  void take_in(const std::vector<std::string>& arguments) const {
    std::vector<std::string> command{"ingest"};
    command.insert(command.end(), arguments.begin(), arguments.end());
    const Finished done = relmap(command);
    ASSERT_EQ(done.exit_code, 0) << done.standard_error;
    ASSERT_TRUE(daemon_->client()->wait_idle().ok());
  }
  client::Session session(std::size_t number) const { return daemon_->client()->sessions().or_throw().at(number - 1); }
  // Every third picture of the left eye, without anything that says of which camera.
  std::string photographs() const {
    for (int pair = 0; pair < kPairs; pair += 3)
      fs::copy_file(picture(pair), file("photos/" + std::to_string(100 + pair) + ".png"));
    return file("photos");
  }

  // Of b in the view that looks as frame a does, nearly: the drive is straight enough.
  Vector3 between(const Where& a, const Where& b) const {
    if (a.frame == b.frame) return b.t - a.t;
    return daemon_->client()->transform_between(a.frame, b.frame).or_throw().T_ab * b.t - a.t;
  }

  static inline storage::TemporaryFolder* recorded_ = nullptr;
  const storage::TemporaryFolder folder_;
  DaemonOptions options_;
  std::unique_ptr<RunningDaemon> daemon_;
};

// No camera is named, and the picture is not of the camera whose pictures have its size.
TEST_F(PictureQuestions, APictureOfTheSessionsSizeMayBeOfAnotherCamera) {
  ASSERT_NO_FATAL_FAILURE(take_in({drive()}));
  const cv::Mat left = cv::imread(picture(kAsked), cv::IMREAD_GRAYSCALE);
  constexpr double kLonger = 1.3;
  const cv::Matx23d zoom(kLonger, 0, 0.5 * (left.cols - 1) * (1 - kLonger), 0, kLonger,
                         0.5 * (left.rows - 1) * (1 - kLonger));
  cv::Mat zoomed;
  cv::warpAffine(left, zoomed, zoom, left.size(), cv::INTER_CUBIC);
  ASSERT_TRUE(cv::imwrite(file("telephone.png"), zoomed));
  const Finished answer = relmap({"localise", file("telephone.png")});
  EXPECT_THAT(answer.standard_error, HasSubstr("camera: that of session"));
  EXPECT_THAT(answer.standard_output, HasSubstr("focal length estimated as"));
  const Vector3 off = between(where(relmap({"localise", picture(kAsked), "--session", "1"})), where(answer));
  EXPECT_LT(off.norm(), 0.5) << off.transpose();
}

TEST_F(PictureQuestions, APictureThatWasStretchedIsRefused) {
  ASSERT_NO_FATAL_FAILURE(take_in({drive()}));
  const cv::Mat left = cv::imread(picture(kAsked), cv::IMREAD_GRAYSCALE);
  cv::Mat narrow;
  cv::resize(left, narrow, {left.cols * 9 / 10, left.rows}, 0, 0, cv::INTER_AREA);
  ASSERT_TRUE(cv::imwrite(file("narrow.png"), narrow));
  const Finished answer = relmap({"localise", file("narrow.png")});
  EXPECT_EQ(answer.exit_code, 1) << answer.standard_output;
  EXPECT_THAT(answer.standard_error, HasSubstr("stretched in height by 1"));
}

// The eyes have different lenses: a right picture that is taken for a left one would be metres off, or refused.
TEST_F(PictureQuestions, APictureOfTheRightEyeGivesThePoseOfThatEye) {
  ASSERT_NO_FATAL_FAILURE(take_in({drive()}));
  const StereoCalibration rig = load_calibration(drive() + "/calib.txt").or_throw();
  constexpr double kLonger = 1.25;
  const cv::Mat right = cv::imread(picture(kAsked, "image_1"), cv::IMREAD_GRAYSCALE);
  const RawCamera& c = rig.left;
  const cv::Matx23d zoom(kLonger, 0, c.cx * (1 - kLonger), 0, kLonger, c.cy * (1 - kLonger));
  cv::Mat zoomed;
  cv::warpAffine(right, zoomed, zoom, right.size());
  ASSERT_TRUE(cv::imwrite(file("cam1/data/x.png"), zoomed));
  fs::copy_file(picture(kAsked), file("cam0/data/x.png"));
  {
    cv::FileStorage yaml(file("rig.yaml"), cv::FileStorage::WRITE);
    yaml << "imageSize" << right.size();
    yaml << "M1" << cv::Mat(cv::Matx33d(c.fx, 0, c.cx, 0, c.fy, c.cy, 0, 0, 1));
    yaml << "M2" << cv::Mat(cv::Matx33d(kLonger * c.fx, 0, c.cx, 0, kLonger * c.fy, c.cy, 0, 0, 1));
    for (const char* lens : {"D1", "D2"}) yaml << lens << cv::Mat::zeros(1, 5, CV_64F);
    yaml << "R" << cv::Mat::eye(3, 3, CV_64F);
    yaml << "T" << cv::Mat(cv::Matx31d(rig.T_right_left.t.x(), 0, 0));
  }
  const Finished left = relmap({"localise", file("cam0/data/x.png"), "--calibration", file("rig.yaml")});
  EXPECT_THAT(left.standard_error, Not(HasSubstr("right eye")));
  const double baseline = -rig.T_right_left.t.x();
  for (const std::vector<std::string>& how :
       std::vector<std::vector<std::string>>{{file("cam1/data/x.png"), "--calibration", file("rig.yaml")},
                                             {picture(kAsked, "image_1"), "--session", "1"},
                                             {picture(kAsked, "image_1")}}) {
    std::vector<std::string> command{"localise"};
    command.insert(command.end(), how.begin(), how.end());
    const Finished answer = relmap(command);
    EXPECT_THAT(answer.standard_error, HasSubstr("right eye"));
    const Vector3 off = between(where(left), where(answer));
    EXPECT_LT((off - Vector3(baseline, 0, 0)).norm(), 0.15) << how[0] << ": " << off.transpose();
  }

  fs::copy_file(picture(kAsked), file("cam0/door_right.png"));
  const Finished word = relmap({"localise", file("cam0/door_right.png"), "--session", "1"});
  EXPECT_EQ(word.exit_code, 0) << word.standard_error;
  EXPECT_THAT(word.standard_error, Not(HasSubstr("right eye"))) << "its folder says that it is the left one's";
  // Of a size that the session's camera does not take: its right eye is not meant, and not said to be.
  cv::Mat small;
  cv::resize(right, small, {}, 0.5, 0.5);
  ASSERT_TRUE(cv::imwrite(file("cam1/data/small.png"), small));
  const Finished other = relmap({"localise", file("cam1/data/small.png"), "--session", "1"});
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_THAT(other.standard_error, Not(HasSubstr("right eye")));
}

// The picture itself is in the map as a photograph: nothing fits it better.
TEST_F(PictureQuestions, ALabelGoesToAFrameThatRoutesLeadTo) {
  const std::string photos = photographs();
  ASSERT_NO_FATAL_FAILURE(take_in({"--mono", photos}));
  const std::string asked = photos + "/" + std::to_string(100 + kAsked) + ".png";
  const Finished alone = relmap({"label", asked, "fountain"});
  EXPECT_EQ(alone.exit_code, 0) << alone.standard_error;
  EXPECT_THAT(alone.standard_output, StartsWith("1:"));
  EXPECT_THAT(alone.standard_error, HasSubstr("no route leads to them: session 1"));

  ASSERT_NO_FATAL_FAILURE(take_in({drive()}));
  const Finished both = relmap({"label", asked, "gate"});
  EXPECT_EQ(both.exit_code, 0) << both.standard_error;
  EXPECT_THAT(both.standard_output, StartsWith("2:"));
  EXPECT_THAT(both.standard_error, Not(HasSubstr("no route leads")));
  EXPECT_EQ(relmap({"route", "--from", "2:0", "--to", "gate"}).exit_code, 0);
}

TEST_F(PictureQuestions, PhotographsThatWereTakenInTwiceDoNotContradictThemselves) {
  const std::string photos = photographs();
  ASSERT_NO_FATAL_FAILURE(take_in({"--mono", photos}));
  ASSERT_NO_FATAL_FAILURE(take_in({"--mono", photos, "--again"}));
  ASSERT_EQ(daemon_->client()->sessions()->size(), 2u);
  const Finished matched = relmap({"match", photos + "/" + std::to_string(100 + kAsked) + ".png"});
  EXPECT_EQ(matched.exit_code, 0) << matched.standard_error;
  EXPECT_THAT(matched.standard_error, Not(HasSubstr("AMBIGUOUS_PLACE")));
  EXPECT_THAT(matched.standard_error, Not(HasSubstr("geometry confirms none"))) << matched.standard_output;
}

TEST_F(PictureQuestions, APairWithoutCalibrationTakesTheOnlyCameraOfItsSize) {
  ASSERT_NO_FATAL_FAILURE(take_in({drive()}));
  const std::string left = file("away/of/it/left.png"), right = file("away/of/it/right.png");
  fs::copy_file(picture(kAsked), left);
  fs::copy_file(picture(kAsked, "image_1"), right);
  const Finished supposed = relmap({"localise", left, right});
  EXPECT_THAT(supposed.standard_error, HasSubstr("camera: that of session " + session(1).name + ", "));
  const Finished named = relmap({"localise", left, right, "--session", "1"});
  EXPECT_THAT(named.standard_error, Not(HasSubstr("camera: ")));
  EXPECT_LT(between(where(named), where(supposed)).norm(), 0.15);

  record_simulation(file("other"), {"--seed", "4", "--pairs", "12", "--laps", "0.05", "--baseline", "0.2"});
  ASSERT_NO_FATAL_FAILURE(take_in({file("other")}));
  ASSERT_EQ(session(2).camera.width, session(1).camera.width);
  const Finished refused = relmap({"localise", left, right});
  EXPECT_EQ(refused.exit_code, 1) << refused.standard_output;
  EXPECT_THAT(refused.standard_error, HasSubstr("NO_CALIBRATION: "));
  for (const char* said : {"sessions with different cameras", "--calibration", "--session"})
    EXPECT_THAT(refused.standard_error, HasSubstr(said));
  EXPECT_EQ(relmap({"localise", left, right, "--session", "1"}).exit_code, 0) << "as it is told to";
}

TEST_F(PictureQuestions, ARefusalIsAJsonObject) {
  ASSERT_NO_FATAL_FAILURE(take_in({drive()}));
  ASSERT_TRUE(cv::imwrite(file("grey.png"), cv::Mat(480, 640, CV_8U, cv::Scalar(128))));
  const Finished refused = relmap({"--json", "localise", file("grey.png")});
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_THAT(refused.standard_output, StartsWith(R"({"error":{"reason":"TOO_FEW_FEATURES","message":")"));
  EXPECT_THAT(refused.standard_error, HasSubstr("TOO_FEW_FEATURES: "));
  const Finished missing = relmap({"--json", "localise", file("none.png")});
  EXPECT_EQ(missing.exit_code, 1);
  EXPECT_THAT(missing.standard_output, StartsWith(R"({"error":{"reason":"NO_SUCH_FILE","message":")"));
}

// The picture that was asked about stands beside each place, and what both show is joined.
TEST_F(PictureQuestions, MatchesAreDrawn) {
  take_in({drive()});
  const Finished done = relmap({"match", picture(kAsked), "--max", "2", "--out", file("match.svg")});
  ASSERT_EQ(done.exit_code, 0) << done.standard_error;
  std::ifstream in(file("match.svg"));
  const std::string svg{std::istreambuf_iterator<char>(in), {}};
  EXPECT_THAT(svg, HasSubstr("Where " + picture_name(kAsked) + " could be"));
  EXPECT_THAT(svg, HasSubstr("matches agree"));
  EXPECT_THAT(svg, HasSubstr("Geometry confirms it"));
  std::size_t pictures = 0;
  for (std::size_t at = svg.find("<image "); at != std::string::npos; at = svg.find("<image ", at + 1)) ++pictures;
  EXPECT_GE(pictures, 2u);
  EXPECT_EQ(pictures % 2, 0u) << "each place stands beside the picture";
  EXPECT_EQ(relmap({"match", picture(kAsked), "--out", file("match.jpg")}).exit_code, 1) << "neither .png nor .svg";
}

}  // namespace
}  // namespace relmap::testing
