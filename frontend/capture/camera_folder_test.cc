#include "frontend/capture/camera_folder.h"

#include <gtest/gtest.h>

#include <cstdlib>

#include "frontend/capture/testing/picture_files.h"

namespace relmap::capture {
namespace {

using testing_files::kKittiCalibration;
using testing_files::TemporaryFolder;
using testing_files::write_text;

bool says(const Status& status, const std::string& what) { return status.message().find(what) != std::string::npos; }

TEST(CameraSettings, AreReadInTheOrderOfTheFile) {
  const auto settings = parse_camera_settings(
      "mode: format7.3\nrate_hz: 7.5\nfirst_byte: left\nfilter: GBRG\n"
      "features: {shutter: auto, gain: 12, sharpness: off, auto_exposure: on, white_balance: once,\n"
      "           brightness: abs 0.0125}\n");
  ASSERT_TRUE(settings.ok()) << settings.status().to_string();
  EXPECT_EQ(settings->mode, "format7.3");
  EXPECT_EQ(settings->rate_hz, 7.5);
  EXPECT_EQ(settings->first_byte, FirstByte::kLeft);
  EXPECT_EQ(settings->filter, ColourFilter::kGBRG);
  const std::vector<std::pair<std::string, std::string>> features = {
      {"shutter", "auto"},       {"gain", "12"},
      {"sharpness", "off"},      {"auto_exposure", "on"},
      {"white_balance", "once"}, {"brightness", "abs 0.0125"}};
  EXPECT_EQ(settings->features, features);
}

TEST(CameraSettings, MayBeLeftOut) {
  EXPECT_EQ(*parse_camera_settings(""), CameraSettings{});
  EXPECT_EQ(*parse_camera_settings("# as it is\n"), CameraSettings{});
  EXPECT_EQ(*parse_camera_settings("features: {}\n"), CameraSettings{});
  const auto none = parse_camera_settings("filter: none\n");
  ASSERT_TRUE(none.ok());
  EXPECT_EQ(none->filter, ColourFilter::kNone);  // said, not left to the camera
}

TEST(CameraSettings, WhatIsWrongIsNamedWithWhatIsAllowed) {
  struct Bad {
    const char *text, *key, *allowed;
  };
  for (const Bad& bad : {Bad{"framerate: 20", "framerate", "rate_hz"},
                         Bad{"mode: 7.3", "mode", "format7.3"},
                         Bad{"mode: format8.1", "mode", "0..7"},
                         Bad{"mode: [format7.3]", "mode", "format7.3"},
                         Bad{"rate_hz: fast", "rate_hz", "0.1..240"},
                         Bad{"rate_hz: 0", "rate_hz", "0.1..240"},
                         Bad{"rate_hz: 20 fps", "rate_hz", "0.1..240"},
                         Bad{"rate_hz: nan", "rate_hz", "0.1..240"},
                         Bad{"rate_hz: 241", "rate_hz", "0.1..240"},
                         Bad{"first_byte: Left", "first_byte", "left, right"},
                         Bad{"filter: RGB", "filter", "none, RGGB, GBRG, GRBG, BGGR"},
                         Bad{"filter:", "filter", "none, RGGB"},
                         Bad{"features: [shutter]", "features", "shutter: auto"},
                         Bad{"features: {gain: loud}", "features.gain", "auto, off"},
                         Bad{"features: {gain: -1}", "features.gain", "0..16777215"},
                         Bad{"features: {gain: 16777216}", "features.gain", "0..16777215"},
                         Bad{"features: {gain: 1.5}", "features.gain", "abs 0.0125"},
                         Bad{"features: {gain: abs}", "features.gain", "abs 0.0125"},
                         Bad{"features: {gain: abs inf}", "features.gain", "abs 0.0125"},
                         Bad{"features: {gain: 1, gain: 2}", "features.gain", "once"},
                         Bad{"just text", "", "map of names"},
                         Bad{"mode: {", "", ""}}) {
    const auto settings = parse_camera_settings(bad.text);
    EXPECT_EQ(settings.reason(), Reason::BAD_CONFIG) << bad.text;
    EXPECT_TRUE(says(settings.status(), bad.key)) << bad.text << " -> " << settings.status().message();
    EXPECT_TRUE(says(settings.status(), bad.allowed)) << bad.text << " -> " << settings.status().message();
  }
}

TEST(CameraFolder, HoldsACameraUnderItsSerialNumber) {
  const TemporaryFolder folder;
  const std::string cameras = folder.path().string();
  write_text(folder.path() / "7140058" / "calib.txt", kKittiCalibration);
  write_text(folder.path() / "7140058" / "settings.yaml", "rate_hz: 20\n");
  write_text(folder.path() / "42.txt", kKittiCalibration);
  write_text(folder.path() / "43" / "settings.yaml", "rate_hz: 5\n");
  write_text(folder.path() / "43.yaml", kKittiCalibration);
  for (const char* serial : {"7140058", "42", "43"}) {
    const auto calibration = camera_calibration(cameras, serial);
    ASSERT_TRUE(calibration.ok()) << calibration.status().to_string();
    EXPECT_NEAR(calibration->T_right_left.t.x(), -0.2, 1e-12);
  }
  EXPECT_EQ(camera_settings(cameras, "7140058")->rate_hz, 20);
  EXPECT_EQ(*camera_settings(cameras, "42"), CameraSettings{});
  EXPECT_EQ(camera_settings(cameras, "43")->rate_hz, 5);
}

TEST(CameraFolder, TellsWhereItLookedForACalibration) {
  const TemporaryFolder folder;
  const std::string own = (folder.path() / "42").string();
  const auto unknown = camera_calibration(folder.path().string(), "42");
  EXPECT_EQ(unknown.reason(), Reason::NO_CALIBRATION);
  EXPECT_TRUE(says(unknown.status(), own + ".yaml")) << unknown.status().message();
  write_text(folder.path() / "42" / "settings.yaml", "rate_hz: 5\n");
  const auto empty = camera_calibration(folder.path().string(), "42");
  EXPECT_EQ(empty.reason(), Reason::NO_CALIBRATION);
  EXPECT_TRUE(says(empty.status(), own + ": ")) << empty.status().message();
  EXPECT_TRUE(says(empty.status(), "calib.txt")) << empty.status().message();
}

TEST(CameraFolder, DamageIsNotTakenForNothing) {
  const TemporaryFolder folder;
  write_text(folder.path() / "42" / "calib.txt", "P0: 1 2 3\n");
  write_text(folder.path() / "42" / "settings.yaml", "rate_hz: 0\n");
  write_text(folder.path() / "42.txt", kKittiCalibration);
  const auto damaged = camera_calibration(folder.path().string(), "42");
  EXPECT_EQ(damaged.reason(), Reason::CORRUPT);
  EXPECT_TRUE(says(damaged.status(), "42/calib.txt")) << damaged.status().message();
  const auto settings = camera_settings(folder.path().string(), "42");
  EXPECT_EQ(settings.reason(), Reason::BAD_CONFIG);
  EXPECT_TRUE(says(settings.status(), "42/settings.yaml")) << settings.status().message();
}

TEST(CameraFolder, StandsWhereConfigurationsDo) {
  const TemporaryFolder folder;
  ::setenv("XDG_CONFIG_HOME", folder.path().c_str(), 1);
  EXPECT_EQ(default_camera_folder(), (folder.path() / "relmap/cameras").string());
  ::unsetenv("XDG_CONFIG_HOME");
  ::setenv("HOME", "/home/robot", 1);
  EXPECT_EQ(default_camera_folder(), "/home/robot/.config/relmap/cameras");
}

}  // namespace
}  // namespace relmap::capture
