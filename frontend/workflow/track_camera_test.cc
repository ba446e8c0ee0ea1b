#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "frontend/workflow/testing/workflow_fixture.h"
#include "frontend/workflow/workflows.h"

namespace relmap::workflow {
namespace {

using ::testing::HasSubstr;

// A camera that sends the street's pairs and then stops the run.
class TrackCameraTest : public WorkflowTest {
 protected:
  TrackCameraTest() {
    options_.source = "iidc";
    options_.path.clear();
    options_.bus = "usb";
    options_.live = true;
    options_.rate_hz = 20;
    daemon_.takes_after_interrupt = true;  // so that every pair is counted
    script_.before = [this](std::size_t i) {
      if (i == script_.pairs.size()) stop_ = true;
    };
    outside_.cameras_on = [this](const std::string& bus) -> Result<OpenCamera> {
      EXPECT_EQ(bus, "usb");
      if (!no_bus_.ok()) return no_bus_;
      return OpenCamera([this](const iidc::IidcOptions& iidc, const std::atomic<bool>&) { return open(iidc); });
    };
  }

  Result<std::unique_ptr<iidc::IidcSource>> open(const iidc::IidcOptions& iidc) {
    asked_ = iidc;
    ++tries_;
    if (!absent_.empty()) {
      const Status why = absent_.front();
      if (absent_.size() > 1 || !for_good_) absent_.erase(absent_.begin());
      if (stop_when_absent_) stop_ = true;
      return why;
    }
    return std::unique_ptr<iidc::IidcSource>(std::make_unique<testing_pairs::FakeCamera>(script_, counts_));
  }

  Status no_bus_;
  std::vector<Status> absent_;  // what opening answers, one after another, before it succeeds
  bool for_good_ = false, stop_when_absent_ = false;
  int tries_ = 0;
  iidc::IidcOptions asked_;
  iidc::LiveCounts counts_{.frames = 12, .lost = 3, .faults = {}, .reopened = 1, .begun_anew = 2, .drift_ppm = 4.5};
};

TEST_F(TrackCameraTest, TracksUntilTheRunIsStopped) {
  options_.camera_folder = "/cameras";
  ASSERT_TRUE(run(track_camera).ok());
  EXPECT_EQ(asked_.rate_hz, 20);
  EXPECT_EQ(asked_.camera_folder, "/cameras");
  EXPECT_EQ(summary_.pairs + summary_.dropped, 12u);
  EXPECT_GE(daemon_.pushed.size(), 1u);
  EXPECT_EQ(summary_.session, "7140058") << "its serial number";
  EXPECT_TRUE(daemon_.opened.at(0).live);
  EXPECT_EQ(daemon_.complete, true) << "there is no more to be had";
  ASSERT_TRUE(summary_.camera.has_value());
  EXPECT_EQ(summary_.camera->serial, "7140058");
  EXPECT_EQ(summary_.camera->lost, 3u);
  EXPECT_EQ(summary_.camera->begun_anew, 2u);
  EXPECT_EQ(summary_.camera->drift_ppm, 4.5);
  EXPECT_EQ(summary_.expected, summary_.pairs + 3);
  EXPECT_TRUE(summary_.rig.has_value()) << "the eyes, as far as they were seen";
  EXPECT_FALSE(summary_.recording.has_value());
  EXPECT_EQ(exit_code(), kInterrupted);
}

// The thread that checks the eyes reads the camera's pictures, so it ends first.
TEST_F(TrackCameraTest, TheEyesAndTheCameraAreReportedBeforeKeyframesAreWaitedFor) {
  bool finishing = false;
  daemon_.at_call = [&](const std::string& call) {
    if (call != "finish") return;
    finishing = true;
    EXPECT_TRUE(summary_.rig.has_value());
    EXPECT_TRUE(summary_.camera.has_value());
  };
  ASSERT_TRUE(run(track_camera).ok());
  EXPECT_TRUE(finishing);
}

TEST_F(TrackCameraTest, WaitsForTheCameraIfAsked) {
  options_.wait = true;
  absent_ = {{Reason::NO_CAMERA, "none"}, {Reason::NO_CAMERA, "none"}, {Reason::CAMERA_BUSY, "another program has it"}};
  ASSERT_TRUE(run(track_camera).ok());
  EXPECT_EQ(tries_, 4);
  EXPECT_THAT(said_, ::testing::StartsWith("NO_CAMERA: none; waiting for it\n"
                                           "CAMERA_BUSY: another program has it; waiting for it\n"))
      << "each reason once";
  EXPECT_GE(summary_.pairs, 1u);
}

TEST_F(TrackCameraTest, DoesNotWaitForTheCameraUnlessAsked) {
  absent_ = {{Reason::NO_CAMERA, "none"}};
  EXPECT_EQ(run(track_camera).to_string(), "NO_CAMERA: none");
  EXPECT_EQ(tries_, 1);
  EXPECT_EQ(exit_code(), kFailed);
}

TEST_F(TrackCameraTest, DoesNotWaitAfterAPermanentError) {
  options_.wait = true;
  absent_ = {{Reason::BAD_CONFIG, "no such mode"}};
  EXPECT_EQ(run(track_camera).reason(), Reason::BAD_CONFIG);
  no_bus_ = {Reason::UNSUPPORTED, "no bus"};
  EXPECT_EQ(run(track_camera).reason(), Reason::UNSUPPORTED);
  EXPECT_EQ(tries_, 1);
}

TEST_F(TrackCameraTest, AStopEndsTheWait) {
  options_.wait = for_good_ = stop_when_absent_ = true;
  absent_ = {{Reason::NO_CAMERA, "none"}};
  EXPECT_EQ(run(track_camera).reason(), Reason::NO_CAMERA);
  EXPECT_EQ(daemon_.opened.size(), 0u);
  EXPECT_EQ(exit_code(), kFailed);
}

TEST_F(TrackCameraTest, ContinuesAfterAFaultOfTheCamera) {
  script_.pairs[5] = Status(Reason::CAMERA_GONE, "unplugged");
  ASSERT_TRUE(run(track_camera).ok());
  EXPECT_EQ(summary_.unreadable.at(Reason::CAMERA_GONE), 1u);
  EXPECT_EQ(summary_.pairs + summary_.dropped, 11u);
  EXPECT_TRUE(summary_.left_out.empty()) << "a camera's faults are not kept one by one";
  EXPECT_THAT(said_, HasSubstr("CAMERA_GONE: unplugged\n"));
}

TEST_F(TrackCameraTest, ReportsAFaultyRigAndContinues) {
  for (auto& pair : script_.pairs) pair->right = vision::Image(pair->right.width(), pair->right.height());
  ASSERT_TRUE(run(track_camera).ok());
  EXPECT_THAT(said_, HasSubstr("the eyes are not as the calibration says: EYE_DEAD: "));
  EXPECT_GE(summary_.pairs, 1u);
  EXPECT_EQ(exit_code(), kInterrupted);
}

TEST_F(TrackCameraTest, EndsWhenAKeyframeIsRefused) {
  daemon_.takes = 0;
  daemon_.refuses_to_push = {Reason::SESSION_DELETED, "by its operator"};
  EXPECT_EQ(run(track_camera).reason(), Reason::SESSION_DELETED);
  EXPECT_TRUE(summary_.camera.has_value()) << "what became of it is told all the same";
  EXPECT_EQ(exit_code(), kFailed);
}

}  // namespace
}  // namespace relmap::workflow
