#include "frontend/capture/first_pairs.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>
#include <vector>

#include "frontend/capture/testing/picture_files.h"

namespace relmap::capture {
namespace {

using testing_files::kKittiCalibration;
using testing_files::noise;

constexpr int kWidth = 160, kHeight = 120, kDisparity = 8;

vision::Image copied(const cv::Mat& picture) {
  vision::Image copy(picture.cols, picture.rows);
  for (int y = 0; y < picture.rows; ++y) std::copy_n(picture.ptr(y), picture.cols, copy.row(y));
  return copy;
}

// Of a wall that is another one each time. The right eye's rows lie `rows` further down.
StereoFrame pair_at(std::int64_t time_us, int rows = 0) {
  const cv::Mat wall = noise(kWidth + kDisparity, kHeight + 10, CV_8UC1, static_cast<int>(time_us / 1000));
  cv::Mat sharp;
  cv::normalize(wall, sharp, 0, 255, cv::NORM_MINMAX);
  StereoFrame frame;
  frame.time_us = time_us;
  frame.left = copied(sharp(cv::Rect(0, 5, kWidth, kHeight)));
  frame.right = copied(sharp(cv::Rect(kDisparity, 5 - rows, kWidth, kHeight)));
  return frame;
}

class FirstPairsTest : public ::testing::Test {
 protected:
  // Gives it pairs 100 ms apart; returns the times of those that it wanted.
  template <typename Frame>
  std::vector<std::int64_t> feed(int pairs, const Frame& frame) {
    std::vector<std::int64_t> wanted;
    for (int i = 0; i < pairs; ++i) {
      const std::int64_t time_us = 1'000'000 + 100'000 * i;
      if (!first_.wants(time_us)) continue;
      wanted.push_back(time_us);
      first_.take(frame(i, time_us));
    }
    return wanted;
  }

  const vision::Rectifier rectifier_ =
      *vision::Rectifier::make(*parse_kitti_calibration(kKittiCalibration), kWidth, kHeight);
  FirstPairs first_{rectifier_};
};

TEST_F(FirstPairsTest, AreSpreadInTimeEachWithWhatIsSeenAMomentLater) {
  const auto wanted = feed(12, [](int, std::int64_t time_us) { return pair_at(time_us); });
  EXPECT_EQ(wanted, (std::vector<std::int64_t>{1'000'000, 1'100'000, 1'500'000, 1'600'000, 2'000'000, 2'100'000}));
  EXPECT_EQ(first_.report().pairs, 3);
}

TEST_F(FirstPairsTest, AreSoonEnoughAndThenNoMoreAreWanted) {
  const auto wanted = feed(1000, [](int, std::int64_t time_us) { return pair_at(time_us); });
  EXPECT_TRUE(first_.enough());
  EXPECT_LE(wanted.size(), 40u) << "20 pairs where no motion shows, each with what comes after it";
  const vision::RigReport report = first_.report();
  EXPECT_EQ(report.pairs, 20);
  EXPECT_TRUE(report.findings.empty()) << report.findings[0].to_string();
}

TEST_F(FirstPairsTest, WhatIsDarkAtFirstIsWaitedFor) {
  feed(400, [](int i, std::int64_t time_us) {
    StereoFrame frame = pair_at(time_us, 3);
    if (i < 120) frame.left = vision::Image(kWidth, kHeight), frame.right = vision::Image(kWidth, kHeight);
    return frame;
  });
  const vision::RigReport report = first_.report();
  ASSERT_EQ(report.findings.size(), 1u);
  EXPECT_EQ(report.findings[0].reason(), Reason::ROWS_APART) << report.findings[0].to_string();
  EXPECT_GE(report.pairs, 10);
}

TEST_F(FirstPairsTest, DarknessIsNoDeadEye) {
  feed(1000, [](int, std::int64_t time_us) {
    StereoFrame frame;
    frame.time_us = time_us;
    frame.left = vision::Image(kWidth, kHeight), frame.right = vision::Image(kWidth, kHeight);
    return frame;
  });
  EXPECT_TRUE(first_.enough()) << "20 s are looked at, no more";
  EXPECT_EQ(first_.report().pairs, 0);
  EXPECT_TRUE(first_.report().findings.empty());
}

TEST_F(FirstPairsTest, OneDarkEyeIsDead) {
  feed(30, [](int, std::int64_t time_us) {
    StereoFrame frame = pair_at(time_us);
    frame.right = vision::Image(kWidth, kHeight);
    return frame;
  });
  ASSERT_EQ(first_.report().findings.size(), 1u);
  EXPECT_EQ(first_.report().findings[0].reason(), Reason::EYE_DEAD);
}

TEST_F(FirstPairsTest, AnEyeThatIsDarkForAWhileIsNotDead) {
  feed(60, [](int i, std::int64_t time_us) {
    StereoFrame frame = pair_at(time_us);
    if (i < 40) frame.right = vision::Image(kWidth, kHeight);
    return frame;
  });
  EXPECT_TRUE(first_.report().findings.empty()) << first_.report().findings[0].to_string();
  EXPECT_EQ(first_.report().pairs, 4);
}

TEST_F(FirstPairsTest, PairsWithoutAnEyeOrOfAnotherSizeAreIgnored) {
  feed(60, [](int i, std::int64_t time_us) {
    StereoFrame frame = pair_at(time_us);
    if (i < 20) frame.right = {};
    if (i >= 20 && i < 40) frame.left = vision::Image(20, 20);
    return frame;
  });
  EXPECT_TRUE(first_.report().findings.empty());
  EXPECT_GE(first_.report().pairs, 3);
}

TEST_F(FirstPairsTest, AClockThatWasSetBackIsNotWaitedFor) {
  feed(3, [](int, std::int64_t time_us) { return pair_at(time_us); });
  EXPECT_FALSE(first_.wants(1'200'000));
  EXPECT_TRUE(first_.wants(-3'600'000'000));
}

}  // namespace
}  // namespace relmap::capture
