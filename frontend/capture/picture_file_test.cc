#include "frontend/capture/picture_file.h"

#include <gtest/gtest.h>

#include "frontend/capture/testing/picture_files.h"

namespace relmap::capture {
namespace {

using testing_files::noise;
using testing_files::TemporaryFolder;
using testing_files::write_picture;
using testing_files::write_text;

TEST(PictureFile, IsGreyOfEightBitsWhateverItIsOnDisk) {
  TemporaryFolder folder;
  const cv::Mat grey = noise(64, 48, CV_8UC1, 1);
  cv::Mat deep, colour;
  grey.convertTo(deep, CV_16UC1, 257);
  cv::cvtColor(grey, colour, cv::COLOR_GRAY2BGR);
  for (const char* ending : {".png", ".jpg", ".JPEG", ".pgm"})
    for (const cv::Mat& picture : {grey, deep, colour}) {
      const bool jpeg = ending[1] == 'j' || ending[1] == 'J', pgm = std::string(ending) == ".pgm";
      if ((jpeg && picture.depth() == CV_16U) || (pgm && picture.channels() == 3)) continue;
      const auto path = folder.path() / (std::string("picture") + ending);
      write_picture(path, picture);
      const auto read = read_picture(path);
      ASSERT_TRUE(read.ok()) << read.status().to_string();
      ASSERT_EQ(read->width(), 64);
      ASSERT_EQ(read->height(), 48);
      for (int y = 0; y < 48; ++y)
        for (int x = 0; x < 64; ++x) EXPECT_NEAR(read->at(x, y), grey.at<std::uint8_t>(y, x), jpeg ? 8 : 1) << ending;
      const auto size = read_picture_size(path);
      ASSERT_TRUE(size.ok());
      EXPECT_EQ(std::pair(size->width, size->height), std::pair(64, 48));
    }
}

TEST(PictureFile, SixteenBitsOfAPngGiveTheirHighByte) {
  TemporaryFolder folder;
  cv::Mat deep(16, 16, CV_16UC1, cv::Scalar(0x12f0));
  write_picture(folder.path() / "deep.png", deep);
  EXPECT_EQ(read_picture(folder.path() / "deep.png")->at(3, 3), 0x12);
}

TEST(PictureFile, RefusesByNameAndNamesTheFile) {
  TemporaryFolder folder;
  const auto refused = [&](const char* name, Reason reason) {
    for (const Status& status :
         {read_picture(folder.path() / name).status(), read_picture_size(folder.path() / name).status()}) {
      EXPECT_EQ(status.reason(), reason) << status.to_string();
      EXPECT_NE(status.message().find(name), std::string::npos);
    }
  };
  refused("none.png", Reason::NO_SUCH_FILE);
  write_text(folder.path() / "text.png", "no picture at all");
  refused("text.png", Reason::NOT_A_PICTURE);
  write_picture(folder.path() / "scan.tiff", noise(64, 48, CV_8UC1, 1));
  refused("scan.tiff", Reason::NOT_A_PICTURE);
  write_picture(folder.path() / "colour.ppm", noise(64, 48, CV_8UC3, 1));
  refused("colour.ppm", Reason::NOT_A_PICTURE);
  for (const char* name : {"cut.png", "cut.jpg"}) {
    write_picture(folder.path() / name, noise(64, 48, CV_8UC1, 1));
    std::filesystem::resize_file(folder.path() / name, std::filesystem::file_size(folder.path() / name) - 6);
    const auto cut = read_picture(folder.path() / name);
    EXPECT_EQ(cut.reason(), Reason::PICTURE_DAMAGED);
    EXPECT_NE(cut.status().message().find(name), std::string::npos);
  }
  write_text(folder.path() / "cut.pgm", "P5\n64 48\n255\n...");
  refused("cut.pgm", Reason::PICTURE_DAMAGED);
  write_text(folder.path() / "long.pgm", "P5\n64 48\n255\n" + std::string(vision::kMaxPictureBytes, 'x'));
  refused("long.pgm", Reason::PICTURE_TOO_LARGE);
}

TEST(PictureFile, IsToldByItsName) {
  for (const char* name : {"a.png", "a.PNG", "b.jpg", "b.JPEG", "c.pgm"}) EXPECT_TRUE(is_picture_name(name)) << name;
  for (const char* name : {"a.tiff", "png", "a.png.txt", ""}) EXPECT_FALSE(is_picture_name(name)) << name;
}

}  // namespace
}  // namespace relmap::capture
