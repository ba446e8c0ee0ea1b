#include "frontend/report_file.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace relmap {
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

TrackedPair pair_of(std::int64_t time_us, int inliers) {
  TrackedPair pair;
  pair.time_us = time_us;
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
  auto report = ReportFile::create(path).or_throw();
  const TrackId lasting{.sequence = 0, .index = 0}, brief{.sequence = 0, .index = 1};
  for (int i = 0; i < 4; ++i) {
    TrackedPair pair = pair_of(1000 + i, 10 * i);
    pair.report.repeated = i == 3;
    if (i < 3) pair.keyframe = keyframe_of(i, i == 0 ? std::vector{lasting, brief} : std::vector{lasting});
    report.add(pair);
  }
  ASSERT_TRUE(report.close().ok());

  const auto lines = lines_of(path);
  ASSERT_GT(lines.size(), 5u);
  EXPECT_TRUE(lines[0].starts_with("time_us\ttracked\t"));
  for (int i = 1; i <= 4; ++i) EXPECT_EQ(columns(lines[i]), columns(lines[0]));
  EXPECT_TRUE(lines[3].starts_with("1002\t1\t0\t0\t"));
  const auto has = [&](const std::string& line) { return std::count(lines.begin(), lines.end(), line) == 1; };
  EXPECT_TRUE(has("# pairs\t4"));
  EXPECT_TRUE(has("# distance, m\t4.000"));
  EXPECT_TRUE(has("# inliers\t15.000\t20.000\t10.000\t20.000")) << "of pairs tracked and not repeated";
  EXPECT_TRUE(has("# track length, keyframes\t2.000\t3.000\t1.000\t3.000"));
  std::filesystem::remove(path);
}

TEST(ReportFile, SaysWhereItCannotBeWritten) {
  EXPECT_EQ(ReportFile::create("/nowhere/report.tsv").reason(), Reason::IO_ERROR);
}

}  // namespace
}  // namespace relmap
