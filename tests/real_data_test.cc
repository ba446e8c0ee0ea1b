// The main job on real recordings: stereo pairs through relmap-frontend and LCM into relmapd, as good a map as the
// truth asks for, and right answers. simulated_street_test does the same where there are no recordings.
#include <gtest/gtest.h>

#include "tests/support/data_test.h"
#include "tests/support/streamed_drive_checks.h"

namespace relmap::testing {
namespace {

using RealData = DataTest;

TEST_F(RealData, AStreetWithMovingCarsBecomesAMapThatAnswers) {
  StreamedDrive drive(data_ + "/kitti_raw_0926_1405");
  expect_every_pair_processed(drive, 160);
  expect_localised(drive, {11, 52, 83, 127, 150}, 0.5);
  expect_localised_by_a_photograph(drive, {11, 52, 83, 127, 150}, 1.5);
  expect_routed(drive, 21, drive.last(), drive.metres_between(21, 159));
  drive.stop();
  expect_drift_below(drive, 0.020, {30, 50}, 20);
}

TEST_F(RealData, AStraightRoadBecomesAMapThatAnswers) {
  StreamedDrive drive(data_ + "/kitti_odom_06_first51");
  expect_every_pair_processed(drive, 51);
  expect_localised(drive, {7, 23, 38}, 0.5);
  expect_routed(drive, 10, drive.last(), drive.metres_between(10, 50));
  drive.stop();
  expect_drift_below(drive, 0.015, {30, 50}, 5);
}

}  // namespace
}  // namespace relmap::testing
