#include "frontend/capture/stereo_source.h"

#include <gtest/gtest.h>

#include "frontend/capture/testing/picture_files.h"

namespace relmap {
namespace {

using testing_files::noise;
using testing_files::TemporaryFolder;
using testing_files::write_picture;
using testing_files::write_text;

constexpr const char* kCalib = "P0: 100 0 79.5 0 0 100 59.5 0 0 0 1 0\nP1: 100 0 79.5 -20 0 100 59.5 0 0 0 1 0\n";

void write_kitti(const std::filesystem::path& folder, int pairs, int type = CV_8UC1) {
  for (int i = 0; i < pairs; ++i) {
    const std::string name = "00000" + std::to_string(i) + ".png";
    write_picture(folder / "image_0" / name, noise(160, 120, type, 2 * i));
    write_picture(folder / "image_1" / name, noise(160, 120, type, 2 * i + 1));
  }
  write_text(folder / "calib.txt", kCalib);
}

TEST(KittiSource, GivesEveryPairInOrder) {
  TemporaryFolder folder;
  write_kitti(folder.path(), 3);
  auto source = open_kitti(folder.path().string());
  ASSERT_TRUE(source.ok()) << source.status().to_string();
  EXPECT_EQ((*source)->count(), 3u);
  EXPECT_EQ((*source)->camera().width, 160);
  EXPECT_NEAR((*source)->camera().baseline, 0.2, 1e-12);
  for (int i = 0; i < 3; ++i) {
    const auto frame = (*source)->next();
    ASSERT_TRUE(frame.ok() && frame->has_value());
    EXPECT_EQ((*frame)->time_us, kRelativeTimeBaseUs + i * 100'000);
    const cv::Mat left = noise(160, 120, CV_8UC1, 2 * i), right = noise(160, 120, CV_8UC1, 2 * i + 1);
    EXPECT_EQ((*frame)->left.at(37, 81), left.at<std::uint8_t>(81, 37));
    EXPECT_EQ((*frame)->right.at(37, 81), right.at<std::uint8_t>(81, 37));
  }
  EXPECT_FALSE((*source)->next()->has_value());
  EXPECT_FALSE((*source)->next()->has_value());
}

TEST(KittiSource, TakesTimesAndSkips) {
  TemporaryFolder folder;
  write_kitti(folder.path(), 3);
  write_text(folder.path() / "times.txt", "0.000000e+00\n1.25e-01\n3.5e-01\n");
  auto source = open_kitti(folder.path().string());
  ASSERT_TRUE(source.ok());
  (*source)->skip_before(kRelativeTimeBaseUs + 125'000);
  EXPECT_EQ((*(*source)->next())->time_us, kRelativeTimeBaseUs + 125'000);
  write_text(folder.path() / "times.txt", "1600000000.5\n1600000001\n1600000002\n");
  source = open_kitti(folder.path().string());
  ASSERT_TRUE(source.ok());
  EXPECT_EQ((*(*source)->next())->time_us, 1'600'000'000'500'000);
}

TEST(KittiSource, TakesSixteenBitsAndColour) {
  for (const int type : {CV_16UC1, CV_8UC3}) {
    TemporaryFolder folder;
    write_kitti(folder.path(), 1, type);
    auto source = open_kitti(folder.path().string());
    ASSERT_TRUE(source.ok());
    const auto frame = (*source)->next();
    ASSERT_TRUE(frame.ok() && frame->has_value());
    EXPECT_EQ((*frame)->left.width(), 160);
  }
}

TEST(KittiSource, RefusesByName) {
  TemporaryFolder folder;
  EXPECT_EQ(open_kitti((folder.path() / "nowhere").string()).reason(), Reason::NO_SUCH_FILE);
  EXPECT_EQ(open_kitti(folder.path().string()).reason(), Reason::NO_SUCH_FILE);
  write_kitti(folder.path(), 3);
  write_text(folder.path() / "times.txt", "0\n0.1\n");
  EXPECT_EQ(open_kitti(folder.path().string()).reason(), Reason::BAD_SIZE);
  write_text(folder.path() / "times.txt", "0\nsoon\n1\n");
  EXPECT_EQ(open_kitti(folder.path().string()).reason(), Reason::CORRUPT);
  write_text(folder.path() / "times.txt", "0\n1\n0.5\n");
  EXPECT_EQ(open_kitti(folder.path().string()).reason(), Reason::TIME_BACKWARDS);
  std::filesystem::remove(folder.path() / "times.txt");
  std::filesystem::remove(folder.path() / "image_1" / "000001.png");
  const auto lonely = open_kitti(folder.path().string());
  EXPECT_EQ(lonely.reason(), Reason::NO_SUCH_FILE);
  EXPECT_NE(lonely.status().message().find("000001.png"), std::string::npos);
  std::filesystem::remove(folder.path() / "calib.txt");
  EXPECT_FALSE(open_kitti(folder.path().string()).ok());
}

TEST(KittiSource, GoesOnAfterABadPicture) {
  TemporaryFolder folder;
  write_kitti(folder.path(), 4);
  write_text(folder.path() / "image_0" / "000001.png", "no picture at all");
  write_picture(folder.path() / "image_1" / "000002.png", noise(80, 60, CV_8UC1, 9));
  auto source = open_kitti(folder.path().string());
  ASSERT_TRUE(source.ok());
  EXPECT_TRUE((*source)->next().ok());
  const auto bad = (*source)->next();
  EXPECT_EQ(bad.reason(), Reason::NOT_A_PICTURE);
  EXPECT_NE(bad.status().message().find("000001.png"), std::string::npos);
  EXPECT_EQ((*source)->next().reason(), Reason::BAD_SIZE);
  EXPECT_TRUE((*source)->next()->has_value());
  EXPECT_FALSE((*source)->next()->has_value());
}

TEST(ImagesSource, PairsByNameOrByOrder) {
  TemporaryFolder folder;
  write_text(folder.path() / "calib.txt", kCalib);
  for (int i = 0; i < 2; ++i) {
    write_picture(folder.path() / "left" / ("left_" + std::to_string(i) + ".jpg"), noise(160, 120, CV_8UC1, i));
    write_picture(folder.path() / "right" / ("right_" + std::to_string(i) + ".JPG.jpg"), noise(160, 120, CV_8UC1, i));
  }
  auto source = open_images(folder.path().string());
  ASSERT_TRUE(source.ok()) << source.status().to_string();
  EXPECT_EQ((*source)->count(), 2u);
  write_picture(folder.path() / "left" / "left_2.jpg", noise(160, 120, CV_8UC1, 7));
  EXPECT_EQ(open_images(folder.path().string()).reason(), Reason::NO_SUCH_FILE);
}

TEST(ImagesSource, ReadsTimesFromNames) {
  TemporaryFolder folder;
  write_text(folder.path() / "calib.txt", kCalib);
  for (const char* name : {"1403715273262142976.png", "1403715273362142976.png"})
    for (const char* eye : {"cam0", "cam1"}) write_picture(folder.path() / eye / name, noise(160, 120, CV_8UC1, 3));
  auto source = open_images(folder.path().string());
  ASSERT_TRUE(source.ok()) << source.status().to_string();
  EXPECT_EQ((*(*source)->next())->time_us, 1'403'715'273'262'142);
}

}  // namespace
}  // namespace relmap
