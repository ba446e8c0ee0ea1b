#include <gtest/gtest.h>

#include "frontend/capture/stereo_source.h"
#include "frontend/capture/testing/picture_files.h"

namespace relmap {
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
  EXPECT_EQ(described("auto", images.path()), "pictures in " + images.path().string() + ": 1 pairs of 160 x 120");
  EXPECT_EQ(described("images", images.path()), described("auto", images.path()));
}

TEST(OpenSource, RefusesByName) {
  TemporaryFolder folder;
  EXPECT_EQ(open_source("lidar", folder.path().string()).reason(), Reason::INVALID_ARGUMENT);
  EXPECT_EQ(open_source("auto", folder.path().string()).reason(), Reason::NO_SUCH_FILE);
  EXPECT_EQ(open_source("auto", (folder.path() / "nowhere").string()).reason(), Reason::NO_SUCH_FILE);
  write_text(folder.path() / "keyframes.bin", "");
  EXPECT_EQ(open_source("sim", folder.path().string()).reason(), Reason::UNSUPPORTED);
  write_text(folder.path() / "sim.json", "{}");
  EXPECT_EQ(open_source("auto", folder.path().string()).reason(), Reason::UNSUPPORTED);
}

}  // namespace
}  // namespace relmap
