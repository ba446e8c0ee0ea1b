#include "frontend/capture/recording_identity.h"

#include <gtest/gtest.h>

#include <chrono>

#include "frontend/capture/keyframe_file.h"
#include "frontend/capture/raw_log.h"
#include "frontend/capture/testing/picture_files.h"
#include "frontend/capture/testing/raw_logs.h"

namespace relmap::capture {
namespace {

namespace fs = std::filesystem;
using testing_files::kKittiCalibration;
using testing_files::noise;
using testing_files::TemporaryFolder;
using testing_files::write_kitti;
using testing_files::write_picture;
using testing_files::write_text;

RecordingIdentity identity(const fs::path& folder) {
  auto source = open_source("auto", folder.string());
  EXPECT_TRUE(source.ok()) << source.status().to_string();
  return source.ok() ? identity_of(**source) : RecordingIdentity{};
}

TEST(RecordingIdentity, IsThatOfACopyElsewhereWrittenLater) {
  TemporaryFolder folder;
  write_kitti(folder.path() / "a", 4);
  write_text(folder.path() / "a/times.txt", "0\n0.1\n0.2\n0.3\n");
  const RecordingIdentity before = identity(folder.path() / "a");
  EXPECT_EQ(before.count, 4u);
  EXPECT_NE(before.calibration.find("focal length 100 px, baseline 0.2 m, checksum "), std::string::npos);
  fs::create_directories(folder.path() / "elsewhere");
  fs::copy(folder.path() / "a", folder.path() / "elsewhere/deep", fs::copy_options::recursive);
  for (const auto& entry : fs::recursive_directory_iterator(folder.path() / "elsewhere"))
    fs::last_write_time(entry.path(), fs::file_time_type::clock::now() + std::chrono::hours(100));
  EXPECT_EQ(identity(folder.path() / "elsewhere/deep"), before);
}

TEST(RecordingIdentity, TellsWhatWasAddedTakenOutOrExchanged) {
  TemporaryFolder folder;
  const fs::path a = folder.path() / "a";
  write_kitti(a, 4);
  const RecordingIdentity before = identity(a);
  // More of the same.
  write_kitti(a, 5);
  RecordingIdentity now = identity(a);
  EXPECT_EQ(now.fingerprint, before.fingerprint);
  EXPECT_EQ(now.count, 5u);
  EXPECT_NE(now.contents, before.contents);
  EXPECT_EQ(now.calibration, before.calibration);
  for (const char* eye : {"image_0", "image_1"}) fs::remove(a / eye / "000004.png");
  EXPECT_EQ(identity(a), before);
  // Another picture in the midst, and one of the other eye that is gone.
  write_picture(a / "image_1/000002.png", noise(160, 120, CV_8UC1, 77));
  now = identity(a);
  EXPECT_EQ(now.fingerprint, before.fingerprint);
  EXPECT_EQ(now.count, 4u);
  EXPECT_NE(now.contents, before.contents);
  write_kitti(a, 4);
  fs::remove(a / "image_1/000003.png");
  EXPECT_NE(identity(a).contents, before.contents);
  // Other times.
  write_kitti(a, 4);
  write_text(a / "times.txt", "0\n0.1\n0.2\n0.4\n");
  EXPECT_NE(identity(a).contents, before.contents);
  fs::remove(a / "times.txt");
  // Another drive of as many pairs.
  for (const char* eye : {"image_0", "image_1"}) fs::rename(a / eye / "000003.png", a / eye / "000000.png");
  write_kitti(folder.path() / "b", 4);
  EXPECT_NE(identity(a).fingerprint, before.fingerprint);
  // A corrected calibration, to the last digit.
  write_kitti(a, 4);
  EXPECT_EQ(identity(a), before);
  write_text(a / "calib.txt",
             "P0: 100 0 79.5 0 0 100 59.5 0 0 0 1 0\nP1: 100 0 79.5 -20.0000001 0 100 59.5 0 0 0 1 0\n");
  now = identity(a);
  EXPECT_NE(now.calibration, before.calibration);
  EXPECT_EQ(now.contents, before.contents);
}

TEST(RecordingIdentity, ReadsNoPictureButTheFirst) {
  TemporaryFolder folder;
  write_kitti(folder.path(), 3);
  const RecordingIdentity before = identity(folder.path());
  const fs::path last = folder.path() / "image_0/000002.png";
  write_text(last, std::string(fs::file_size(last), 'x'));
  EXPECT_EQ(identity(folder.path()), before) << "as long as the one that it replaces";
}

TEST(RecordingIdentity, OfAFlightIsThatOfItsInertialUnitToo) {
  TemporaryFolder folder;
  for (const char* eye : {"cam0", "cam1"})
    for (const char* name : {"1403715273262142976.png", "1403715273362142976.png"})
      write_picture(folder.path() / eye / "data" / name, noise(160, 120, CV_8UC1, 1));
  write_text(folder.path() / "calib.txt", kKittiCalibration);
  const RecordingIdentity without = identity(folder.path());
  write_text(folder.path() / "imu0/data.csv", "1403715273262142976,0,0,0,9.8,0,0\n");
  write_text(folder.path() / "imu0/sensor.yaml", "noise: 1\n");
  const RecordingIdentity with = identity(folder.path());
  EXPECT_NE(with.contents, without.contents);
  write_text(folder.path() / "imu0/sensor.yaml", "noise: 2\n");
  EXPECT_NE(identity(folder.path()).contents, with.contents) << "corrected, and no longer";
}

TEST(RecordingIdentity, OfARawLogTellsThatItGrew) {
  TemporaryFolder folder;
  const std::string log = (folder.path() / "a.raw").string(), longer = (folder.path() / "b.raw").string();
  testing_files::write_raw_log(log, testing_files::raw_header(), 3);
  testing_files::write_raw_log(longer, testing_files::raw_header(), 4);
  const RecordingIdentity before = identity(log), after = identity(longer);
  EXPECT_EQ(before, identity(log));
  EXPECT_EQ(before.fingerprint, after.fingerprint);
  EXPECT_EQ(before.calibration, after.calibration);
  EXPECT_EQ(before.count + 1, after.count);
  EXPECT_NE(before.contents, after.contents);
}

class KeyframeFileIdentityTest : public ::testing::Test {
 protected:
  std::string write(const std::string& name, std::uint32_t first, std::uint32_t end, double x = 0) {
    const std::string path = (folder_.path() / name).string();
    auto writer = KeyframeFileWriter::create(path).or_throw();
    for (std::uint32_t i = first; i < end; ++i) {
      Keyframe keyframe;
      keyframe.session.robot = "cart";
      keyframe.session.name = "morning";
      keyframe.session.uuid.bytes[3] = 7;
      keyframe.session.camera = {400, 256, 192, 0.12, 512, 384};
      keyframe.sequence = i;
      keyframe.time_us = 1000 * i;
      keyframe.T_odom_frame.t.x() = x * i;
      EXPECT_TRUE(writer.write(keyframe).ok());
    }
    EXPECT_TRUE(writer.close().ok());
    return path;
  }
  TemporaryFolder folder_;
};

TEST_F(KeyframeFileIdentityTest, TellsKeyframesAndWhoseTheyAre) {
  const auto whole = identity_of_keyframes(write("a", 0, 5)).or_throw();
  EXPECT_EQ(whole.session.robot, "cart");
  EXPECT_EQ(whole.session.name, "morning");
  EXPECT_EQ(whole.recording.count, 5u);
  EXPECT_EQ(whole.recording.fingerprint, "keyframes of session " + whole.session.uuid.to_string());
  EXPECT_EQ(identity_of_keyframes(write("copy", 0, 5))->recording, whole.recording);
  const auto longer = identity_of_keyframes(write("b", 0, 6)).or_throw();
  EXPECT_EQ(longer.recording.fingerprint, whole.recording.fingerprint);
  EXPECT_EQ(longer.recording.count, 6u);
  const auto otherwise = identity_of_keyframes(write("c", 0, 5, 0.1)).or_throw();
  EXPECT_EQ(otherwise.recording.count, 5u);
  EXPECT_NE(otherwise.recording.contents, whole.recording.contents) << "as long, and driven elsewhere";
}

TEST_F(KeyframeFileIdentityTest, ATruncatedFileHasTheIdentityOfItsWholeKeyframes) {
  const std::string path = write("a", 0, 5);
  fs::resize_file(path, fs::file_size(path) - 3);
  EXPECT_EQ(identity_of_keyframes(path)->recording, identity_of_keyframes(write("b", 0, 4))->recording);
  write_text(path, "\xff\xff\xff\xff and so on");
  EXPECT_EQ(identity_of_keyframes(path).reason(), Reason::BAD_SIZE);
  write_text(path, "");
  EXPECT_EQ(identity_of_keyframes(path).reason(), Reason::BAD_SIZE);
  EXPECT_EQ(identity_of_keyframes(path + " nowhere").reason(), Reason::NO_SUCH_FILE);
}

}  // namespace
}  // namespace relmap::capture
