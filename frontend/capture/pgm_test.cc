#include "frontend/capture/pgm.h"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "frontend/capture/testing/picture_files.h"

namespace relmap::capture {
namespace {

TEST(Pgm, IsWhatOpenCvWrites) {
  for (const int type : {CV_8UC1, CV_16UC1}) {
    const cv::Mat picture = testing_files::noise(37, 21, type, 5);
    Bytes file;
    ASSERT_TRUE(cv::imencode(".pgm", picture, file));
    ASSERT_TRUE(is_pgm(file));
    const auto image = decode_pgm(file);
    ASSERT_TRUE(image.ok()) << image.status().to_string();
    ASSERT_EQ(image->width(), 37);
    ASSERT_EQ(image->height(), 21);
    for (int y = 0; y < 21; ++y)
      for (int x = 0; x < 37; ++x) {
        if (type == CV_8UC1) {
          EXPECT_EQ(image->at(x, y), picture.at<std::uint8_t>(y, x));
        } else {
          EXPECT_NEAR(image->at(x, y), picture.at<std::uint16_t>(y, x) / 257.0, 0.51);
        }
      }
  }
}

TEST(Pgm, WhiteIsTheLargestValueThatTheHeaderNames) {
  const std::string pixels = {0x0f, '\xff', 0x08, 0x00, 0x00, 0x00};
  const auto image = decode_pgm(as_bytes("P5 # twelve bits\n3 1\n# of a camera\n4095\n" + pixels));
  ASSERT_TRUE(image.ok()) << image.status().to_string();
  EXPECT_EQ(image->at(0, 0), 255);
  EXPECT_EQ(image->at(1, 0), 128);
  EXPECT_EQ(image->at(2, 0), 0);
}

TEST(Pgm, RefusesByName) {
  EXPECT_FALSE(is_pgm(as_bytes("P6\n1 1\n255\nabc")));
  EXPECT_FALSE(is_pgm(as_bytes("P5")));
  for (const char* damaged : {"P5\n", "P5\n2 2\n", "P5\n2 2\n0\nabcd", "P5\n-2 2\n255\nabcd", "P5\n2 2\n255\nabc",
                              "P5\n2 2\n65536\nabcdefgh", "P5\n2 2\n256\nabcd", "P5\n2 x\n255\nabcd", "P5 #"})
    EXPECT_EQ(decode_pgm(as_bytes(damaged)).reason(), Reason::PICTURE_DAMAGED) << damaged;
  EXPECT_EQ(decode_pgm(as_bytes("P5\n999999 999999\n255\n")).reason(), Reason::PICTURE_TOO_LARGE);
}

}  // namespace
}  // namespace relmap::capture
