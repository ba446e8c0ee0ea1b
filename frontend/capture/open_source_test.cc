#include <gtest/gtest.h>

#include "frontend/capture/keyframe_file.h"
#include "frontend/capture/stereo_source.h"
#include "frontend/capture/testing/picture_files.h"

namespace relmap::capture {
namespace {

using testing_files::kKittiCalibration;
using testing_files::noise;
using testing_files::TemporaryFolder;
using testing_files::write_kitti;
using testing_files::write_picture;
using testing_files::write_text;

std::string described(const std::string& kind, const std::filesystem::path& folder) {
  const auto source = open_source(kind, folder.string());
  return source.ok() ? (*source)->describe() : source.status().to_string();
}

TEST(OpenSource, LooksAtTheFolder) {
  TemporaryFolder kitti;
  write_kitti(kitti.path(), 2);
  write_text(kitti.path() / "times.txt", "0\n0.1\n");
  EXPECT_EQ(described("auto", kitti.path()), "KITTI data set " + kitti.path().string() + ": 2 pairs of 160 x 120");
  EXPECT_EQ(described("kitti", kitti.path()), described("auto", kitti.path()));
  write_text(kitti.path() / "sim.json", "{}");
  EXPECT_EQ(described("auto", kitti.path()), "simulated drive " + kitti.path().string() + ": 2 pairs of 160 x 120");
  EXPECT_EQ(described("sim", kitti.path()), described("auto", kitti.path()));

  TemporaryFolder euroc;
  for (const char* eye : {"cam0", "cam1"})
    write_picture(euroc.path() / "mav0" / eye / "data" / "1403715273262142976.png", noise(160, 120, CV_8UC1, 1));
  write_text(euroc.path() / "calib.txt", kKittiCalibration);
  EXPECT_EQ(described("auto", euroc.path()), "EuRoC data set " + euroc.path().string() + ": 1 pairs of 160 x 120");
  EXPECT_EQ(described("euroc", euroc.path()), described("auto", euroc.path()));

  TemporaryFolder images;
  for (const char* eye : {"left", "right"}) write_picture(images.path() / eye / "1.png", noise(160, 120, CV_8UC1, 1));
  write_text(images.path() / "calib.txt", kKittiCalibration);
  EXPECT_EQ(described("auto", images.path()),
            "pictures in " + images.path().string() + ": 1 pairs of 160 x 120, times by a rate of 10/s (no times.txt)");
  EXPECT_EQ(described("images", images.path()), described("auto", images.path()));
}

TEST(OpenSource, SaysWhenTimesAreByTheRate) {
  TemporaryFolder folder;
  write_kitti(folder.path(), 2);
  const auto source = open_source("auto", folder.path().string(), {.calibration = {}, .rate_hz = 12.5});
  ASSERT_TRUE(source.ok()) << source.status().to_string();
  EXPECT_TRUE((*source)->describe().ends_with(", times by a rate of 12.5/s (no times.txt)")) << (*source)->describe();
}

void expect_refused(const std::string& kind, const std::filesystem::path& path, Reason reason,
                    const std::string& words) {
  const auto source = open_source(kind, path.string());
  EXPECT_EQ(source.reason(), reason) << kind << ' ' << path;
  EXPECT_NE(source.status().message().find(path.string()), std::string::npos) << source.status().to_string();
  EXPECT_NE(source.status().message().find(words), std::string::npos) << source.status().to_string();
}

TEST(OpenSource, RefusesByName) {
  TemporaryFolder folder;
  EXPECT_EQ(open_source("lidar", folder.path().string()).reason(), Reason::INVALID_ARGUMENT);
  expect_refused("auto", folder.path(), Reason::NO_SUCH_FILE, "left and right");
  expect_refused("auto", folder.path() / "nowhere", Reason::NO_SUCH_FILE, "is no folder");
  expect_refused("sim", folder.path() / "nowhere", Reason::NO_SUCH_FILE, "is no folder");
}

TEST(OpenSource, ReadsAsSimulatedOnlyWhatTheSimulatorWrote) {
  TemporaryFolder folder;
  write_kitti(folder.path(), 2);
  expect_refused("sim", folder.path(), Reason::NO_SUCH_FILE, "--source auto or kitti");
  write_text(folder.path() / "sim.json", "{}");
  EXPECT_TRUE(open_source("sim", folder.path().string()).ok());
}

TEST(OpenSource, TellsFilesOfKeyframesFromOthers) {
  TemporaryFolder folder;
  const auto file = folder.path() / "keyframes.bin";
  for (const char* kind : {"sim", "auto"}) {
    write_text(file, "a text of some length");
    expect_refused(kind, file, Reason::UNSUPPORTED, "is none of");
  }
  std::filesystem::remove(file);
  auto writer = KeyframeFileWriter::create(file.string());
  ASSERT_TRUE(writer.ok() && writer->write({}).ok() && writer->close().ok());
  for (const char* kind : {"sim", "auto"}) expect_refused(kind, file, Reason::UNSUPPORTED, "holds keyframes");
  expect_refused("sim", folder.path(), Reason::UNSUPPORTED, "holds keyframes");
  write_text(folder.path() / "sim.json", "{}");
  expect_refused("auto", folder.path(), Reason::UNSUPPORTED, "holds keyframes");
}

TEST(OpenSource, SaysWhereItLookedForACalibration) {
  TemporaryFolder kitti, images;
  write_kitti(kitti.path(), 1);
  std::filesystem::remove(kitti.path() / "calib.txt");
  for (const char* eye : {"left", "right"}) write_picture(images.path() / eye / "1.png", noise(160, 120, CV_8UC1, 1));
  for (const char* words : {"calib.txt", "--calibration FILE"}) {
    expect_refused("kitti", kitti.path(), Reason::NO_SUCH_FILE, words);
    expect_refused("images", images.path(), Reason::NO_SUCH_FILE, words);
  }
  expect_refused("images", images.path(), Reason::NO_SUCH_FILE, "cam0/sensor.yaml");
}

}  // namespace
}  // namespace relmap::capture
