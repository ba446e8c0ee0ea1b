// Real recordings: stereo pairs go through relmap-frontend and LCM into relmapd, and the map agrees with the truth and
// gives right answers. simulated_street_test does the same without recordings.
#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <set>

#include "tests/support/data_test.h"
#include "tests/support/process.h"
#include "tests/support/streamed_drive_checks.h"
#include "tests/support/streamed_sessions.h"
#include "tests/support/world_truth.h"

namespace relmap::testing {
namespace {

using RealData = DataTest;
namespace fs = std::filesystem;

// A KITTI recording without its first pair.
void drop_first_pair(const fs::path& recording, const fs::path& into) {
  fs::create_directories(into);
  fs::copy_file(recording / "calib.txt", into / "calib.txt");
  if (fs::exists(recording / "times.txt")) {
    const std::string times = read_text((recording / "times.txt").string());
    std::ofstream(into / "times.txt") << times.substr(times.find('\n') + 1);
  }
  for (const char* eye : {"image_0", "image_1"}) {
    fs::create_directory(into / eye);
    std::set<fs::path> pictures;
    for (const auto& entry : fs::directory_iterator(recording / eye)) pictures.insert(entry.path());
    for (auto picture = std::next(pictures.begin()); picture != pictures.end(); ++picture)
      fs::create_symlink(*picture, into / eye / picture->filename());
  }
}

// One robot takes every second pair, another one those between. What the first saw is all there for the second: parts
// of its pictures that seem to have changed are moving cars, or mistakes. A place that looks alike is told by 2 %
// (docs/method.md, 7).
void expect_hardly_changed(const std::string& recording) {
  const storage::TemporaryFolder folder;
  const fs::path between = folder / "between";
  drop_first_pair(recording, between);
  StreamedSessions sessions({"--deterministic"});
  sessions.stream("kitti", recording, "first", {"--every", "2"});
  sessions.stream("kitti", between.string(), "second", {"--every", "2"});
  int closures = 0;
  unsigned compared = 0, changed = 0;
  for (const storage::Edge& edge : edges_of(sessions.stop(), 2)) {
    if (edge.kind != storage::EdgeKind::kLoop) continue;
    ++closures;
    compared += edge.uniqueness.compared;
    changed += edge.uniqueness.changed;
  }
  std::printf("%s: %d closures, %u of %u parts of pictures changed\n", recording.c_str(), closures, changed, compared);
  EXPECT_GT(closures, 30);
  EXPECT_GT(compared, 1000u);
  EXPECT_LT(changed, 0.01 * compared);
}

TEST_F(RealData, AStreetWithMovingCarsBecomesAMapThatAnswers) {
  StreamedDrive drive(data_ + "/kitti_raw_0926_1405");
  expect_every_pair_processed(drive, 160);
  expect_localised(drive, {11, 52, 83, 127, 150}, 0.5);
  expect_localised_by_a_photograph(drive, {11, 52, 83, 127, 150}, 1.5);
  expect_routed(drive, 21, drive.last(), drive.metres_between(21, 159));
  drive.stop();
  expect_drift_below(drive, {.odometry = 0.020, .map = 0.020}, {30, 50}, 20);
}

TEST_F(RealData, AStraightRoadBecomesAMapThatAnswers) {
  StreamedDrive drive(data_ + "/kitti_odom_06_first51");
  expect_every_pair_processed(drive, 51);
  expect_localised(drive, {7, 23, 38}, 0.5);
  expect_routed(drive, 10, drive.last(), drive.metres_between(10, 50));
  drive.stop();
  expect_drift_below(drive, {.odometry = 0.015, .map = 0.015}, {30, 50}, 5);
}

TEST_F(RealData, AJustSeenPlaceIsSeldomTakenForAChange) {
  expect_hardly_changed(data_ + "/kitti_raw_0926_1405");
  expect_hardly_changed(data_ + "/boofcv_backyard");
}

}  // namespace
}  // namespace relmap::testing
