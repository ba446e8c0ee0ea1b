// The programs with a simulated camera: its pictures become a map that closes its loop, and relmap-camera finds, sets,
// shows, checks and records it.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>
#include <optional>
#include <regex>
#include <stdexcept>
#include <string>
#include <thread>
#include <variant>
#include <vector>

#include "frontend/capture/picture_file.h"
#include "frontend/capture/raw_log_reader.h"
#include "storage/testing/temporary_folder.h"
#include "tests/camera/default_frame.h"
#include "tests/camera/shown_drive.h"
#include "tests/camera/simulated_camera.h"
#include "tests/camera/usb_testbed.h"
#include "tests/support/process.h"
#include "tests/support/running_daemon.h"
#include "tests/support/simulated_recording.h"

namespace relmap::testing {
namespace {

using namespace std::chrono_literals;

// A drive that relmap-sim makes, and a camera that shows it.
class Drive : public ShownDrive {
 public:
  Drive(const std::string& folder, std::size_t pairs, const std::vector<std::string>& arguments)
      : ShownDrive(record(folder, pairs, arguments)), folder_(folder) {}

  // The folder of cameras that has its calibration.
  std::string cameras(const std::string& folder) const {
    std::filesystem::create_directories(folder + "/12345678");
    std::filesystem::copy_file(folder_ + "/calib.txt", folder + "/12345678/calib.txt");
    return folder;
  }

 private:
  static std::string record(const std::string& folder, std::size_t pairs, const std::vector<std::string>& arguments) {
    std::vector<std::string> all{"--pairs", std::to_string(pairs)};
    all.insert(all.end(), arguments.begin(), arguments.end());
    return record_simulation(folder, all);
  }

  const std::string folder_;
};

double number_of(const std::string& json, const std::string& key) {
  const std::size_t at = json.find("\"" + key + "\":");
  if (at == std::string::npos) throw std::runtime_error("no " + key + " in " + json);
  return std::stod(json.substr(at + key.size() + 3));
}

void wait_until_sent(const UsbTestbed& testbed, const std::shared_ptr<SimulatedCamera>& camera, std::uint64_t frames) {
  const auto until = std::chrono::steady_clock::now() + 60s;
  while (testbed.counters(camera).frames < frames) {
    ASSERT_LT(std::chrono::steady_clock::now(), until);
    std::this_thread::sleep_for(20ms);
  }
}

// A program that is started meanwhile has real devices, and files of its own: the daemon's allocator and the library
// that is loaded before it do not go together.
class WithoutMock {
 public:
  WithoutMock() : libraries_(std::getenv("LD_PRELOAD")) { ::unsetenv("LD_PRELOAD"); }
  ~WithoutMock() { ::setenv("LD_PRELOAD", libraries_.c_str(), 1); }
  WithoutMock(const WithoutMock&) = delete;
  WithoutMock& operator=(const WithoutMock&) = delete;

 private:
  const std::string libraries_;
};

class IidcPrograms : public ::testing::Test {
 protected:
  std::vector<std::string> camera_command(std::vector<std::string> words) {
    std::vector<std::string> all{built_program("relmap-camera"), "--cameras", folder_ / "cameras"};
    all.insert(all.end(), words.begin(), words.end());
    return all;
  }
  Finished camera(std::vector<std::string> words) { return run_program(camera_command(std::move(words))); }

  storage::TemporaryFolder folder_;
};

// The main job, live.
TEST_F(IidcPrograms, WhatACameraShowsBecomesAMapThatClosesItsLoop) {
  constexpr std::size_t kPairs = 150;
  constexpr double kRate = 10;
  const Drive drive(folder_ / "drive", kPairs, {"--seed", "5", "--laps", "1.25", "--step", "0.25"});
  const std::string cameras = drive.cameras(folder_ / "cameras");
  const auto daemon = [&] {
    const WithoutMock without;
    return std::make_unique<RunningDaemon>(DaemonOptions{.data = folder_ / "map", .lcm = "", .more = {}});
  }();
  UsbTestbed testbed;
  const auto camera = std::make_shared<SimulatedCamera>(drive.camera(kRate));
  testbed.plug(camera);
  Process frontend({built_program("relmap-frontend"), "--source", "iidc", "--cameras", cameras, "--robot", "cart",
                    "--server", folder_ / "map", "--spool", folder_ / "spool", "--json", "--quiet"},
                   {folder_ / "summary", folder_ / "errors"});
  wait_until_sent(testbed, camera, kPairs + 5);
  std::this_thread::sleep_for(1s);
  frontend.signal(SIGINT);
  EXPECT_EQ(frontend.wait(60s), 4) << read_text(folder_ / "errors");
  const std::string summary = read_text(folder_ / "summary");
  std::cout << summary;
  EXPECT_NE(summary.find("\"lost\":0,\"reopened\":0,\"begun_anew\":0"), std::string::npos);
  EXPECT_GE(number_of(summary, "tracked"), 0.9 * kPairs);
  EXPECT_EQ(testbed.counters(camera).lost, 0u);
  const auto client = daemon->client();
  ASSERT_TRUE(client->wait_idle().ok());
  const auto sessions = client->sessions().or_throw();
  ASSERT_EQ(sessions.size(), 1u);
  EXPECT_EQ(sessions.front().name, "12345678");
  EXPECT_EQ(sessions.front().robot, "cart");
  EXPECT_GT(sessions.front().frames, 20u);
  const auto status = client->status().or_throw();
  EXPECT_GT(status.closures_accepted, 0u);
  EXPECT_EQ(status.closures_quarantined, 0u);
}

TEST_F(IidcPrograms, TheFrontEndGoesOnWhereTheCameraIsPluggedInAgain) {
  const Drive drive(folder_ / "drive", 60, {"--seed", "5", "--laps", "0.5", "--step", "0.25"});
  const std::string cameras = drive.cameras(folder_ / "cameras");
  UsbTestbed testbed;
  const auto camera = std::make_shared<SimulatedCamera>(drive.camera(10));
  testbed.plug(camera);
  Process frontend({built_program("relmap-frontend"), "--source", "iidc", "12345678", "--cameras", cameras, "--robot",
                    "cart", "--out", folder_ / "keyframes.bin", "--json", "--quiet"},
                   {folder_ / "summary", folder_ / "errors"});
  wait_until_sent(testbed, camera, 30);
  ASSERT_TRUE(testbed.unplug_in_mid_frame(camera));
  std::this_thread::sleep_for(400ms);
  testbed.plug(camera);
  wait_until_sent(testbed, camera, 30);
  frontend.signal(SIGINT);
  EXPECT_EQ(frontend.wait(60s), 4);
  const std::string summary = read_text(folder_ / "summary"), errors = read_text(folder_ / "errors");
  EXPECT_EQ(number_of(summary, "reopened"), 1) << summary;
  EXPECT_NE(errors.find("CAMERA_GONE"), std::string::npos) << errors;
  EXPECT_NE(summary.find("\"CAMERA_GONE\":1"), std::string::npos) << summary;
  EXPECT_GE(number_of(summary, "pairs"), 45);
}

// A robot drives on, and is told at once and at the end.
TEST_F(IidcPrograms, ExchangedEyesAreReportedWhileTheCameraGoesOn) {
  const Drive drive(folder_ / "drive", 60, {"--seed", "5", "--laps", "0.5", "--step", "0.25"});
  const std::string cameras = drive.cameras(folder_ / "cameras");
  std::ofstream(cameras + "/12345678/settings.yaml") << "first_byte: left\n";
  UsbTestbed testbed;
  const auto camera = std::make_shared<SimulatedCamera>(drive.shuttling_camera(10));
  testbed.plug(camera);
  Process frontend({built_program("relmap-frontend"), "--source", "iidc", "--cameras", cameras, "--robot", "cart",
                    "--out", folder_ / "keyframes.bin", "--json", "--quiet"},
                   {folder_ / "summary", folder_ / "errors"});
  const auto until = std::chrono::steady_clock::now() + 60s;
  while (read_text(folder_ / "errors").find("the eyes are exchanged") == std::string::npos) {
    ASSERT_LT(std::chrono::steady_clock::now(), until) << read_text(folder_ / "errors");
    std::this_thread::sleep_for(20ms);
  }
  EXPECT_TRUE(frontend.running()) << "it goes on";
  frontend.signal(SIGINT);
  frontend.wait(60s);
  const std::string summary = read_text(folder_ / "summary");
  EXPECT_NE(summary.find("\"findings\":[{\"reason\":\"NOT_STEREO\""), std::string::npos) << summary;
  EXPECT_NE(summary.find("\"trusted\":false"), std::string::npos) << summary;
}

TEST_F(IidcPrograms, AMissingCameraIsReportedAtOnce) {
  UsbTestbed testbed;
  const Finished done = run_program(
      {built_program("relmap-frontend"), "--source", "iidc", "--robot", "cart", "--out", folder_ / "keyframes.bin"});
  EXPECT_EQ(done.exit_code, 1);
  EXPECT_NE(done.standard_error.find("NO_CAMERA"), std::string::npos) << done.standard_error;
  const Finished listed = camera({"list"});
  EXPECT_EQ(listed.exit_code, 0);
  EXPECT_NE(listed.standard_error.find("no IIDC camera"), std::string::npos);
}

TEST_F(IidcPrograms, ACameraIsFoundSetLookedThroughAndChecked) {
  const Drive drive(folder_ / "drive", 12, {"--seed", "5", "--laps", "0.1"});
  UsbTestbed testbed;
  const auto simulated = std::make_shared<SimulatedCamera>(drive.shuttling_camera(20));
  testbed.plug(simulated);

  const Finished bare = camera({"list"});
  EXPECT_NE(bare.standard_output.find("12345678"), std::string::npos) << bare.standard_output << bare.standard_error;
  EXPECT_NE(bare.standard_output.find("none"), std::string::npos);  // no calibration yet
  const Finished refused = camera({"check"});
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_NE(refused.standard_error.find("NO_CALIBRATION"), std::string::npos) << refused.standard_error;

  drive.cameras(folder_ / "cameras");
  const Finished info = camera({"--json", "info", "12345678"});
  EXPECT_EQ(info.exit_code, 0) << info.standard_error;
  EXPECT_NE(info.standard_output.find("format7.3"), std::string::npos) << info.standard_output;
  EXPECT_NE(info.standard_output.find("shutter"), std::string::npos);

  const Finished set = camera({"set", "12345678", "brightness=100", "shutter=abs 0.01", "trigger=off"});
  EXPECT_EQ(set.exit_code, 0) << set.standard_error;
  EXPECT_NE(set.standard_output.find("(0.0099"), std::string::npos) << set.standard_output;
  EXPECT_EQ(camera({"set", "brightness=1000"}).exit_code, 2);
  EXPECT_EQ(camera({"set", "brightness"}).exit_code, 2);
  EXPECT_EQ(camera({"set", "zoom=3"}).exit_code, 1);

  const Finished shown = camera({"--quiet", "show", "--out", folder_ / "pictures", "--count", "2"});
  EXPECT_EQ(shown.exit_code, 0) << shown.standard_error;
  int pictures = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder_ / "pictures")) {
    const auto size = capture::read_picture_size(entry.path()).or_throw();
    EXPECT_EQ(size.width, 2 * simulated->options().width);
    ++pictures;
  }
  EXPECT_EQ(pictures, 2);

  const Finished well = camera({"check", "--pairs", "10"});
  EXPECT_EQ(well.exit_code, 0) << well.standard_output << well.standard_error;
  EXPECT_NE(well.standard_output.find("all is well"), std::string::npos) << well.standard_output;

  // The other byte is the left eye's: its settings mend it.
  std::ofstream(folder_ / "cameras/12345678/settings.yaml") << "first_byte: left\n";
  const Finished exchanged = camera({"--json", "check", "--pairs", "10"});
  EXPECT_EQ(exchanged.exit_code, 3) << exchanged.standard_error;
  EXPECT_NE(exchanged.standard_output.find("NOT_STEREO"), std::string::npos) << exchanged.standard_output;

  simulated->fail([](CameraFaults& faults) { faults.dead_eye = capture::FirstByte::kRight; });
  const Finished dead = camera({"check", "--pairs", "10"});
  EXPECT_EQ(dead.exit_code, 3);
  EXPECT_NE(dead.standard_output.find("EYE_DEAD"), std::string::npos) << dead.standard_output;
}

TEST_F(IidcPrograms, WhatIsRecordedIsTrackedLater) {
  const Drive drive(folder_ / "drive", 40, {"--seed", "5", "--laps", "0.3", "--step", "0.25"});
  drive.cameras(folder_ / "cameras");
  UsbTestbed testbed;
  const auto simulated = std::make_shared<SimulatedCamera>(drive.camera(20));
  testbed.plug(simulated);
  const std::string file = folder_ / "drive.raw";
  const Finished recorded = camera({"--json", "--quiet", "record", file, "--frames", "40"});
  ASSERT_EQ(recorded.exit_code, 0) << recorded.standard_error;
  EXPECT_NE(recorded.standard_output.find("\"frames\":40"), std::string::npos) << recorded.standard_output;
  EXPECT_EQ(camera({"record", file, "--frames", "1"}).exit_code, 2);  // nothing is written over
  const auto log = capture::RawLogReader::open(file).or_throw();
  EXPECT_EQ(log.frames(), 40u);
  EXPECT_EQ(log.header().serial, "12345678");
  ASSERT_TRUE(log.header().calibration);

  const Finished replayed = camera({"replay", file, "--rate", "max", "--", "--robot", "cart", "--out",
                                    folder_ / "keyframes.bin", "--json", "--quiet"});
  ASSERT_EQ(replayed.exit_code, 0) << replayed.standard_error;
  EXPECT_EQ(number_of(replayed.standard_output, "pairs"), 40) << replayed.standard_output;
  EXPECT_EQ(number_of(replayed.standard_output, "tracked"), 40) << replayed.standard_output;
  const Finished checked = camera({"check", file, "--pairs", "10"});
  EXPECT_EQ(checked.exit_code, 0) << checked.standard_output << checked.standard_error;
}

// 640 x 480 x 2 at 20 frames/s, received, stamped, checksummed and written to a file; `relmap-bench capture` says at
// what cost.
TEST_F(IidcPrograms, WhatIsRecordedIsWhole) {
  constexpr std::uint64_t kFrames = 60;
  UsbTestbed testbed;
  SimulatedCameraOptions options;
  options.rate = 20;
  const auto simulated = std::make_shared<SimulatedCamera>(options);
  testbed.plug(simulated);
  const std::string file = folder_ / "whole.raw";
  const Finished done = camera({"--json", "--quiet", "record", file, "--frames", std::to_string(kFrames)});
  ASSERT_EQ(done.exit_code, 0) << done.standard_error;
  EXPECT_NE(done.standard_output.find("\"lost\":0,\"dropped\":0"), std::string::npos) << done.standard_output;
  auto log = capture::RawLogReader::open(file).or_throw();
  EXPECT_EQ(log.frames(), kFrames);
  std::optional<std::uint64_t> before;
  while (const auto record = log.next().or_throw()) {
    const auto* frame = std::get_if<capture::RawLogReader::Frame>(&*record);
    ASSERT_TRUE(frame) << "a gap";
    const auto number = default_frame_number(frame->raw.first(std::min<std::size_t>(frame->raw.size(), 614'400)));
    ASSERT_TRUE(number) << "torn";
    EXPECT_TRUE(!before || *number == *before + 1) << *number;
    before = number;
  }
}

}  // namespace
}  // namespace relmap::testing
