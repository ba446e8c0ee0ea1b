#include "frontend/report_file.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace relmap::frontend {
namespace {

std::vector<std::string> lines_of(const std::string& path) {
  std::vector<std::string> lines;
  std::ifstream in(path);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

std::size_t columns(const std::string& line) {
  return 1 + static_cast<std::size_t>(std::count(line.begin(), line.end(), '\t'));
}

tracking::TrackedPair reported_pair(std::int64_t time_us, int inliers) {
  tracking::TrackedPair pair;
  pair.time_us = time_us;
  pair.index = static_cast<std::uint64_t>(time_us - 1000);
  pair.picture = "left.png";
  pair.report.tracked = inliers > 0;
  pair.report.expected = 2 * inliers;
  pair.report.found = 2 * inliers;
  pair.report.inliers = inliers;
  return pair;
}

Keyframe keyframe_of(std::uint32_t sequence, std::vector<TrackId> tracks) {
  Keyframe keyframe;
  keyframe.sequence = sequence;
  keyframe.source = sequence == 0 ? MotionSource::kStart : MotionSource::kVision;
  keyframe.T_odom_frame.t.z() = 2.0 * sequence;
  for (const TrackId track : tracks) keyframe.tracks.push_back({.track = track});
  return keyframe;
}

TEST(ReportFile, HasALineForEachPairAndASummary) {
  const std::string path = ::testing::TempDir() + "relmap_report_file_test.tsv";
  auto report = ReportFile::open(path, false).or_throw();
  const TrackId lasting{.sequence = 0, .index = 0}, brief{.sequence = 0, .index = 1};
  for (int i = 0; i < 4; ++i) {
    tracking::TrackedPair pair = reported_pair(1000 + i, 10 * i);
    pair.report.repeated = i == 3;
    if (i < 3) pair.keyframe = keyframe_of(i, i == 0 ? std::vector{lasting, brief} : std::vector{lasting});
    report.add(pair);
  }
  ASSERT_TRUE(report.close().ok());

  const auto lines = lines_of(path);
  ASSERT_GT(lines.size(), 5u);
  EXPECT_TRUE(lines[0].starts_with("pair\tpicture\ttime_us\ttracked\t"));
  for (int i = 1; i <= 4; ++i) EXPECT_EQ(columns(lines[i]), columns(lines[0]));
  EXPECT_TRUE(lines[3].starts_with("2\tleft.png\t1002\t1\t0\t0\t"));
  const auto has = [&](const std::string& line) { return std::count(lines.begin(), lines.end(), line) == 1; };
  EXPECT_TRUE(has("# pairs\t4"));
  EXPECT_TRUE(has("# distance, m\t4.000"));
  EXPECT_TRUE(has("# inliers\t15.000\t20.000\t10.000\t20.000")) << "of pairs tracked and not repeated";
  EXPECT_TRUE(has("# track length, keyframes\t2.000\t3.000\t1.000\t3.000"));
  std::filesystem::remove(path);
}

TEST(ReportFile, IsAddedToWhenARunGoesOn) {
  const std::string path = ::testing::TempDir() + "relmap_report_goes_on_test.tsv";
  std::filesystem::remove(path);
  std::vector<std::string> before;
  for (const int pair : {7, 8}) {
    auto report = ReportFile::open(path, true).or_throw();
    report.add(reported_pair(1000 + pair, 10));
    const auto lines = lines_of(path);
    ASSERT_EQ(lines.size(), before.empty() ? 2 : before.size() + 1) << "a pair's line is there at once";
    EXPECT_TRUE(lines.back().starts_with(std::to_string(pair) + "\tleft.png\t"));
    EXPECT_EQ(std::vector(lines.begin(), lines.begin() + static_cast<std::ptrdiff_t>(before.size())), before);
    ASSERT_TRUE(report.close().ok());
    before = lines_of(path);
  }
  EXPECT_EQ(std::count(before.begin(), before.end(), "# pairs\t1"), 2) << "a summary of each run";

  ASSERT_TRUE(ReportFile::open(path, false).or_throw().close().ok());
  const auto replaced = lines_of(path);
  EXPECT_EQ(std::count(replaced.begin(), replaced.end(), "# pairs\t0"), 1) << "a new run begins anew";
  EXPECT_EQ(std::count(replaced.begin(), replaced.end(), "# pairs\t1"), 0);
  std::filesystem::remove(path);
}

TEST(ReportFile, IsNotAddedToAFileOfOtherColumns) {
  const std::string path = ::testing::TempDir() + "relmap_report_other_test.tsv";
  std::ofstream(path) << "time_us\ttracked\n1\t1\n";
  const auto other = ReportFile::open(path, true);
  EXPECT_EQ(other.reason(), Reason::INVALID_ARGUMENT);
  EXPECT_EQ(ReportFile::open(path, false).reason(), Reason::INVALID_ARGUMENT) << "nor is it replaced";
  EXPECT_NE(other.status().message().find(path), std::string::npos);
  EXPECT_EQ(lines_of(path).size(), 2u) << "it stays as it was";
  std::filesystem::remove(path);
}

TEST(ReportFile, SaysWhereItCannotBeWritten) {
  for (const bool goes_on : {false, true})
    EXPECT_EQ(ReportFile::open("/nowhere/report.tsv", goes_on).reason(), Reason::IO_ERROR);
}

// Reading from it gives zeros without end.
TEST(ReportFile, ADeviceIsWrittenAndNotRead) { EXPECT_TRUE(ReportFile::open("/dev/zero", false).ok()); }

}  // namespace
}  // namespace relmap::frontend
