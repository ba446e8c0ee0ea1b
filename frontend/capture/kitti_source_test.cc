#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "frontend/capture/stereo_source.h"
#include "frontend/capture/testing/picture_files.h"

namespace relmap::capture {
namespace {

using testing_files::noise;
using testing_files::TemporaryFolder;
using testing_files::write_kitti;
using testing_files::write_picture;
using testing_files::write_text;

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
  const auto frame = (*source)->next();
  ASSERT_TRUE(frame.ok() && frame->has_value());
  EXPECT_EQ((*frame)->time_us, kRelativeTimeBaseUs + 125'000);
  EXPECT_EQ((*frame)->index, 1u) << "of all pairs, those skipped among them";
  EXPECT_EQ((*frame)->picture, "000001.png");
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

// Whoever uses the pairs decides what to make of a clock that jumps.
TEST(KittiSource, GivesTimesAsTheyAre) {
  TemporaryFolder folder;
  write_kitti(folder.path(), 3);
  write_text(folder.path() / "times.txt", "0\n1\n0.5\n");
  const auto source = open_kitti(folder.path().string());
  ASSERT_TRUE(source.ok()) << source.status().to_string();
  std::vector<std::int64_t> times;
  while (auto frame = (*source)->next().or_throw()) times.push_back(frame->time_us);
  ASSERT_EQ(times.size(), 3u);
  EXPECT_EQ(times[1] - times[0], 1'000'000);
  EXPECT_EQ(times[2] - times[0], 500'000);
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
  std::filesystem::remove(folder.path() / "times.txt");
  std::filesystem::remove(folder.path() / "calib.txt");
  EXPECT_FALSE(open_kitti(folder.path().string()).ok());
}

// The next pair has only one eye, for `reason` and of that name.
void expect_one_eye(StereoSource& source, bool left, Reason reason, const std::string& name) {
  const auto frame = source.next();
  ASSERT_TRUE(frame.ok() && frame->has_value()) << name;
  EXPECT_EQ((*frame)->left.empty(), !left) << name;
  EXPECT_EQ((*frame)->right.empty(), left) << name;
  EXPECT_EQ((*frame)->eye_missing.reason(), reason) << name;
  EXPECT_NE((*frame)->eye_missing.message().find(name), std::string::npos) << (*frame)->eye_missing.to_string();
}

void expect_both_eyes(StereoSource& source) {
  const auto frame = source.next();
  ASSERT_TRUE(frame.ok() && frame->has_value());
  EXPECT_FALSE((*frame)->left.empty() || (*frame)->right.empty());
  EXPECT_TRUE((*frame)->eye_missing.ok());
}

TEST(KittiSource, GivesTheOtherEyeBesideABadPicture) {
  TemporaryFolder folder;
  write_kitti(folder.path(), 5);
  write_text(folder.path() / "image_0" / "000001.png", "no picture at all");
  write_picture(folder.path() / "image_1" / "000002.png", noise(80, 60, CV_8UC1, 9));
  write_picture(folder.path() / "image_0" / "000003.png", noise(80, 60, CV_8UC1, 9));
  write_text(folder.path() / "image_1" / "000003.png", "no picture at all");
  auto source = open_kitti(folder.path().string());
  ASSERT_TRUE(source.ok());
  expect_both_eyes(**source);
  expect_one_eye(**source, false, Reason::NOT_A_PICTURE, "image_0/000001.png");
  expect_one_eye(**source, true, Reason::BAD_SIZE, "image_1/000002.png");
  const auto neither = (*source)->next();
  EXPECT_EQ(neither.reason(), Reason::BAD_SIZE);
  EXPECT_NE(neither.status().message().find("image_0/000003.png"), std::string::npos);
  expect_both_eyes(**source);
  EXPECT_FALSE((*source)->next()->has_value());
}

TEST(KittiSource, GivesTheOtherEyeBesideAMissingPicture) {
  TemporaryFolder folder;
  write_kitti(folder.path(), 5);
  write_text(folder.path() / "times.txt", "0\n0.1\n0.2\n0.3\n0.4\n");
  std::filesystem::remove(folder.path() / "image_0" / "000000.png");
  std::filesystem::remove(folder.path() / "image_1" / "000002.png");
  std::filesystem::remove(folder.path() / "image_0" / "000003.png");
  std::filesystem::remove(folder.path() / "image_1" / "000003.png");
  auto source = open_kitti(folder.path().string());
  ASSERT_TRUE(source.ok()) << source.status().to_string();
  EXPECT_EQ((*source)->count(), 4u);
  expect_one_eye(**source, false, Reason::NO_SUCH_FILE, "image_0/000000.png");
  expect_both_eyes(**source);
  expect_one_eye(**source, true, Reason::NO_SUCH_FILE, "image_1/000002.png");
  // Of 000003 nothing is left: the time of 000004 is still its own.
  EXPECT_EQ((*(*source)->next())->time_us, kRelativeTimeBaseUs + 400'000);
  EXPECT_FALSE((*source)->next()->has_value());
}

TEST(KittiSource, TimesThatLeaveOutWhatTheNumbersLeaveOutAreTakenInOrder) {
  TemporaryFolder folder;
  write_kitti(folder.path(), 8);
  // Of ten frames 3 and 4 were never there, in the times neither; 8 and 9 were lost in copying.
  write_text(folder.path() / "times.txt", "0\n0.1\n0.2\n0.5\n0.6\n0.7\n0.8\n0.9\n");
  for (const char* eye : {"image_0", "image_1"})
    for (const char* lost : {"000003.png", "000004.png"}) std::filesystem::remove(folder.path() / eye / lost);
  auto source = open_kitti(folder.path().string());
  ASSERT_TRUE(source.ok()) << source.status().to_string();
  std::vector<std::int64_t> times;
  while (const auto frame = (*source)->next().or_throw()) times.push_back(frame->time_us - kRelativeTimeBaseUs);
  EXPECT_THAT(times, ::testing::ElementsAre(0, 100'000, 200'000, 500'000, 600'000, 700'000));
  const MissingPictures missing = (*source)->missing();
  EXPECT_EQ(missing.count, 2u);
  EXPECT_THAT(missing.first, ::testing::Contains(::testing::HasSubstr("time 7")));
}

TEST(KittiSource, OfOneEyeHasNoBaseline) {
  TemporaryFolder folder;
  write_kitti(folder.path(), 2);
  std::filesystem::remove_all(folder.path() / "image_1");
  auto source = open_kitti(folder.path().string());
  ASSERT_TRUE(source.ok()) << source.status().to_string();
  EXPECT_EQ((*source)->camera().baseline, 0);
  EXPECT_TRUE((*source)->calibration().mono());
  EXPECT_NE((*source)->describe().find("2 pictures of one eye"), std::string::npos) << (*source)->describe();
  auto frame = (*source)->next();
  ASSERT_TRUE(frame.ok() && frame->has_value());
  EXPECT_TRUE((*frame)->right.empty());
  const auto rectified = rectify((*source)->rectifier(), std::move(**frame));
  ASSERT_TRUE(rectified.ok());
  EXPECT_EQ(rectified->left.width(), 160);
}

TEST(KittiSource, RefusesPairsWithTheCalibrationOfOneCamera) {
  TemporaryFolder folder;
  write_kitti(folder.path(), 1);
  write_text(folder.path() / "calib.txt", "P0: 100 0 79.5 0 0 100 59.5 0 0 0 1 0\n");
  EXPECT_EQ(open_kitti(folder.path().string()).reason(), Reason::NOT_STEREO);
}

}  // namespace
}  // namespace relmap::capture
