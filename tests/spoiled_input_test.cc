// Recordings that look right and are wrong: none ends with exit code 0, and the fault of each is named.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "frontend/capture/first_pairs.h"
#include "frontend/vision/rectify.h"
#include "proto/calibration/calibration.h"
#include "storage/testing/temporary_folder.h"
#include "tests/support/other_camera.h"
#include "tests/support/process.h"
#include "tests/support/running_daemon.h"
#include "tests/support/simulated_recording.h"

namespace relmap::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

constexpr int kPairs = 51;

class SpoiledInput : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new storage::TemporaryFolder();
    record_simulation(sound(), {"--seed", "3", "--pairs", std::to_string(kPairs), "--laps", "0.2"});
    auto calibration = load_calibration(sound() + "/calib.txt").or_throw();
    const cv::Mat first = cv::imread(sound() + "/image_0/000000.png", cv::IMREAD_GRAYSCALE);
    camera_ = vision::Rectifier::make(calibration, first.cols, first.rows).or_throw().camera();
  }
  static void TearDownTestSuite() {
    delete folder_;
    folder_ = nullptr;
  }

  static std::string file(const std::string& name) { return *folder_ / name; }
  static std::string sound() { return file("sound"); }

  // A copy of the sound drive.
  static std::string copy(const std::string& name) {
    fs::copy(sound(), file(name), fs::copy_options::recursive);
    return file(name);
  }
  // With every picture of an eye changed.
  using Change = std::function<cv::Mat(const cv::Mat&)>;
  static void change(const std::string& drive, const std::string& eye, const Change& change) {
    for (int pair = 0; pair < kPairs; ++pair) {
      const std::string path = drive + "/" + eye + "/" + picture_name(pair);
      cv::imwrite(path, change(cv::imread(path, cv::IMREAD_GRAYSCALE)));
    }
  }
  static Change turned(const cv::Vec3d& degrees) {
    const cv::Mat H = intrinsics_of(camera_) * turn(degrees) * intrinsics_of(camera_).inv();
    return [H](const cv::Mat& picture) {
      cv::Mat turned;
      cv::warpPerspective(picture, turned, H, picture.size(), cv::INTER_LINEAR, cv::BORDER_REFLECT);
      return turned;
    };
  }
  static Change raw(const cv::Vec3d& degrees, const std::vector<double>& distortion) {
    return [=](const cv::Mat& picture) { return through_lens(picture, camera_, distortion, degrees); };
  }

  static Finished track(const std::string& recording, const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments{
        built_program("relmap-frontend"), recording, "--robot", "r", "--out", recording + ".bin"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_program(arguments);
  }

  // Of a recording whose eyes are wrong: it is refused before anything is begun, with the reason and what helps;
  // tracked all the same where that is asked for.
  static void expect_refused(const std::string& recording, const std::string& reason) {
    const Finished refused = track(recording, {"--json"});
    EXPECT_EQ(refused.exit_code, 1) << recording << refused.standard_output;
    EXPECT_THAT(refused.standard_error, HasSubstr("relmap-frontend: " + reason + ": ")) << recording;
    EXPECT_THAT(refused.standard_error, HasSubstr("what helps: "));
    EXPECT_THAT(refused.standard_error, HasSubstr("--despite-check"));
    EXPECT_THAT(refused.standard_output, HasSubstr("\"findings\":[{\"reason\":\"" + reason + "\"")) << recording;
    EXPECT_THAT(refused.standard_output, HasSubstr("\"trusted\":false"));
    EXPECT_THAT(refused.standard_output, HasSubstr("\"error\":{\"reason\":\"" + reason + "\""));
    EXPECT_FALSE(fs::exists(recording + ".bin") || fs::exists(recording + ".bin.part")) << recording;
  }

  static inline storage::TemporaryFolder* folder_ = nullptr;
  static inline StereoCamera camera_;
};

TEST_F(SpoiledInput, ASoundRecordingEndsWithExitCodeZero) {
  const Finished done = track(sound(), {"--json"});
  EXPECT_EQ(done.exit_code, 0) << done.standard_error;
  for (const char* said : {"\"trusted\":true,\"expected\":51,\"seen\":51,\"measured\":51", "\"findings\":[]",
                           "\"missing\":{\"count\":0,\"first\":[]}", "\"row_error_px\":0.0"})
    EXPECT_THAT(done.standard_output, HasSubstr(said));
  const Finished text = track(sound());
  EXPECT_THAT(text.standard_output, StartsWith("session "));
  EXPECT_THAT(text.standard_error, Not(HasSubstr("eyes")));
}

// Good cameras in all kinds of worlds are neither refused nor warned of.
TEST_F(SpoiledInput, SoundRecordingsOfManyKindsPassTheCheck) {
  const std::vector<std::vector<std::string>> kinds = {{"--seed", "21", "--light", "dusk"},
                                                       {"--seed", "22", "--scene", "motorway"},
                                                       {"--seed", "23", "--width", "256", "--noise", "6"},
                                                       {"--seed", "24", "--exposure", "0.02", "--exposure-jumps", "3"},
                                                       {"--seed", "26", "--step", "0.02", "--rate", "20"},
                                                       {"--seed", "27", "--faults", "black:2,one_eye:20"}};
  for (const auto& kind : kinds) {
    const std::string drive = file("kind" + kind[1]);
    std::vector<std::string> arguments{"--pairs", "40", "--laps", kind[2] == "--step" ? "0.03" : "0.1"};
    arguments.insert(arguments.end(), kind.begin(), kind.end());
    record_simulation(drive, arguments);
    const auto source = capture::open_source("sim", drive).or_throw();
    const vision::RigReport rig = capture::check_first_pairs(*source, [] { return false; });
    EXPECT_TRUE(rig.findings.empty()) << kind[1] << ": " << rig.findings[0].to_string();
    EXPECT_GE(rig.pairs, 2) << kind[1];
    EXPECT_LT(rig.row_error, 0.1) << kind[1];
    EXPECT_LT(rig.negative_disparity, 0.01) << kind[1];
    EXPECT_LT(std::abs(rig.yaw_by_rows.value_or(0)), 0.1) << kind[1];
    EXPECT_LT(std::abs(rig.yaw_by_motion.value_or(0)), 0.1) << kind[1];
  }
}

TEST_F(SpoiledInput, RowsThreePixelsApart) {
  const std::string drive = copy("rows");
  change(drive, "image_1", [](const cv::Mat& picture) {
    cv::Mat shifted;
    cv::copyMakeBorder(picture.rowRange(0, picture.rows - 3), shifted, 3, 0, 0, 0, cv::BORDER_REFLECT);
    return shifted;
  });
  expect_refused(drive, "ROWS_APART");
  const Finished despite = track(drive, {"--despite-check"});
  EXPECT_NE(despite.exit_code, 0);
  EXPECT_THAT(despite.standard_error, Not(HasSubstr("TOO_FEW_FEATURES"))) << "which would only follow from it";
  EXPECT_THAT(despite.standard_error, HasSubstr("the eyes are not as the calibration says: ROWS_APART"));
  EXPECT_THAT(despite.standard_output, StartsWith("NOT TO BE TRUSTED\n"));
  EXPECT_THAT(despite.standard_output, HasSubstr("ROWS_APART"));
}

TEST_F(SpoiledInput, AnEyeTurnedByADegreeAboutAnyAxis) {
  for (const double degrees : {-1.0, 1.0})
    for (int axis = 0; axis < 3; ++axis) {
      cv::Vec3d angles(0, 0, 0);
      angles[axis] = degrees;
      const std::string drive = copy("turned" + std::to_string(axis) + (degrees < 0 ? "-" : "+"));
      change(drive, "image_1", turned(angles));
      expect_refused(drive, axis == 1 ? "NOT_STEREO" : "ROWS_APART");
    }
  // Nothing else would have told: all of it is tracked, and the path is much too short.
  const Finished despite = track(file("turned1-"), {"--despite-check", "--json"});
  EXPECT_EQ(despite.exit_code, 5) << despite.standard_error;
  EXPECT_THAT(despite.standard_output, HasSubstr("\"measured_share\":1,"));
}

TEST_F(SpoiledInput, RawPicturesThatAreDeclaredRectified) {
  const std::string drive = copy("raw");
  change(drive, "image_0", raw({0.3, -0.4, 0.2}, {-0.28, 0.07, 0.0002, 0.00002, 0}));
  change(drive, "image_1", raw({-0.5, 0.5, -0.4}, {-0.27, 0.06, -0.0001, 0.0003, 0}));
  expect_refused(drive, "ROWS_APART");
}

TEST_F(SpoiledInput, ADeadEye) {
  const std::string drive = copy("dead");
  change(drive, "image_1", [](const cv::Mat& picture) { return cv::Mat::zeros(picture.size(), CV_8UC1); });
  expect_refused(drive, "EYE_DEAD");
}

TEST_F(SpoiledInput, MissingRightPicturesAreCountedAgainstTheExpectedPairs) {
  const std::string drive = copy("missing");
  for (int pair = 0; pair < kPairs; ++pair)
    if (pair % 5 != 0 || pair == 50) fs::remove(drive + "/image_1/" + picture_name(pair));
  const Finished done = track(drive, {"--json"});
  EXPECT_EQ(done.exit_code, 5) << done.standard_error;
  for (const char* said :
       {"\"trusted\":false,\"expected\":51,\"seen\":10,\"measured\":10", "\"measured_share\":0.196078",
        "\"missing\":{\"count\":41,\"first\":[\"", "/image_1/000001.png\",\"", "\"error\":null"})
    EXPECT_THAT(done.standard_output, HasSubstr(said));
  const Finished text = track(drive);
  EXPECT_EQ(text.exit_code, 5);
  EXPECT_THAT(text.standard_output, StartsWith("NOT TO BE TRUSTED\n  measured      19.6 % of the pairs that there "
                                               "should be (10 of 51)"));
  EXPECT_THAT(text.standard_output, HasSubstr("missing       41, the first: " + drive + "/image_1/000001.png, "));
}

TEST_F(SpoiledInput, ListsOfWhichOneIsShorter) {
  const std::string drive = copy("lists");
  std::ofstream left(drive + "/left.txt"), right(drive + "/right.txt");
  for (int pair = 0; pair < kPairs; ++pair) {
    left << 100 + 0.1 * pair << " image_0/" << picture_name(pair) << '\n';
    if (pair < 10) right << 100 + 0.1 * pair << " image_1/" << picture_name(pair) << '\n';
  }
  left.close(), right.close();
  const Finished done = track(drive, {"--source", "images", "--json"});
  EXPECT_EQ(done.exit_code, 5) << done.standard_error;
  EXPECT_THAT(done.standard_output, HasSubstr("\"expected\":51,\"seen\":10,\"measured\":10"));
  EXPECT_THAT(done.standard_output, HasSubstr("\"count\":41,\"first\":[\"the other eye of "));
}

TEST_F(SpoiledInput, TimesWithoutPictures) {
  const std::string drive = copy("times");
  for (int pair = 30; pair < kPairs; ++pair)
    for (const char* eye : {"/image_0/", "/image_1/"}) fs::remove(drive + eye + picture_name(pair));
  const Finished done = track(drive, {"--json"});
  EXPECT_EQ(done.exit_code, 5) << done.standard_error;
  EXPECT_THAT(done.standard_output, HasSubstr("\"expected\":51,\"seen\":30,\"measured\":30"));
  EXPECT_THAT(done.standard_output, HasSubstr("times.txt, time 31"));
}

TEST_F(SpoiledInput, FewerPairsMeasuredThanFourOfFive) {
  const std::string drive = copy("dark");
  const auto darken = [&](int from, int to) {
    for (int pair = from; pair < to; ++pair)
      for (const char* eye : {"/image_0/", "/image_1/"}) {
        const std::string path = drive + eye + picture_name(pair);
        cv::imwrite(path, cv::Mat::zeros(camera_.height, camera_.width, CV_8UC1));
      }
  };
  darken(20, 26);
  const Finished little = track(drive, {"--json"});
  EXPECT_EQ(little.exit_code, 0) << little.standard_output;
  darken(20, 34);
  const Finished much = track(drive);
  EXPECT_EQ(much.exit_code, 5) << much.standard_output;
  EXPECT_THAT(much.standard_output, StartsWith("NOT TO BE TRUSTED\n  measured      "));
}

TEST_F(SpoiledInput, OneEyeAloneIsExpectedOfAMonoSession) {
  const std::string drive = copy("mono");
  fs::remove_all(drive + "/image_1");
  const Finished done = track(drive, {"--source", "images", "--mono", "--every", "10", "--json"});
  EXPECT_EQ(done.exit_code, 0) << done.standard_error;
  EXPECT_THAT(done.standard_output, HasSubstr("\"trusted\":true,\"expected\":0"));
}

TEST_F(SpoiledInput, ABatchNamesItsUntrustedRecordings) {
  setenv("XDG_STATE_HOME", file("state").c_str(), 1);
  const std::string missing = copy("batch-missing"), askew = copy("batch-askew");
  for (int pair = 0; pair < kPairs; ++pair)
    if (pair % 5 != 0 || pair == 50) fs::remove(missing + "/image_1/" + picture_name(pair));
  change(askew, "image_1", turned({0, -1, 0}));
  DaemonOptions options;
  options.data = file("map");
  RunningDaemon daemon(options);
  const auto ingest = [&](const std::vector<std::string>& recordings, bool json = true) {
    std::vector<std::string> command{built_program("relmap"), "--server", options.data, "ingest"};
    if (json) command.insert(command.begin() + 3, "--json");
    command.insert(command.end(), recordings.begin(), recordings.end());
    return run_program(command);
  };
  const Finished good = ingest({sound()});
  EXPECT_EQ(good.exit_code, 0) << good.standard_error;
  EXPECT_THAT(good.standard_output, HasSubstr("\"untrusted\":0"));

  const Finished doubtful = ingest({sound(), missing});
  EXPECT_EQ(doubtful.exit_code, 5) << doubtful.standard_error;
  for (const char* said :
       {"\"untrusted\":1", "\"failed\":0", "\"trusted\":false,\"expected\":51,\"seen\":10", "\"pictures_missing\":41"})
    EXPECT_THAT(doubtful.standard_output, HasSubstr(said));
  const Finished later = ingest({missing}, false);
  EXPECT_EQ(later.exit_code, 5) << "what was there already is to be trusted no more: " << later.standard_error;
  EXPECT_THAT(later.standard_output, StartsWith("NOT TO BE TRUSTED: "));
  EXPECT_THAT(later.standard_output, HasSubstr("19.6 % measured (10 of 51 pairs, 41 pictures are missing)"));

  const Finished wrong = ingest({askew});
  EXPECT_EQ(wrong.exit_code, 1);
  EXPECT_THAT(wrong.standard_output, HasSubstr("\"error\":{\"reason\":\"NOT_STEREO\""));
  EXPECT_EQ(daemon.client()->sessions()->size(), 2u) << "nothing of it is in the map";
  const Finished despite = ingest({askew, "--despite-check"});
  EXPECT_EQ(despite.exit_code, 5) << despite.standard_error;
  EXPECT_THAT(despite.standard_output, HasSubstr("\"findings\":[{\"reason\":\"NOT_STEREO\""));
}

// Its eyes are wrong, and somebody insists: where nothing can be tracked there is no session to be taken out again.
TEST_F(SpoiledInput, WhatCannotBeTrackedBeginsNoSession) {
  setenv("XDG_STATE_HOME", file("untracked-state").c_str(), 1);
  const std::string drive = copy("untracked");
  change(drive, "image_1", [](const cv::Mat& picture) { return cv::Mat::zeros(picture.size(), CV_8UC1); });
  DaemonOptions options;
  options.data = file("untracked-map");
  RunningDaemon daemon(options);
  const Finished failed =
      run_program({built_program("relmap"), "--server", options.data, "ingest", drive, "--despite-check"});
  EXPECT_EQ(failed.exit_code, 1);
  EXPECT_THAT(failed.standard_output, HasSubstr("EYE_DEAD: none of 51 pairs could be tracked"));
  EXPECT_TRUE(daemon.client()->sessions()->empty());
  EXPECT_EQ(track(drive, {"--despite-check"}).exit_code, 1);
  EXPECT_FALSE(fs::exists(drive + ".bin") || fs::exists(drive + ".bin.part"));
}

}  // namespace
}  // namespace relmap::testing
