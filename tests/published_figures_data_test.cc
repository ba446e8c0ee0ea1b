// What docs/rba.md and docs/frontend.md say of recordings (label data).
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "tests/support/bench_figures.h"
#include "tests/support/data_test.h"
#include "tests/support/published.h"

namespace relmap::testing {
namespace {

class PublishedFiguresData : public DataTest {};

// A hundredth of a unit, as they are printed; costs are sums of squares and do not depend on chance.
TEST_F(PublishedFiguresData, RecordedMeasurementsEndWhereTheDocumentSays) {
  const BenchFigures found({"rba", "--scenario", "real", "--data", data_});
  const char* const kDocument = "docs/rba.md";
  const auto street = published(kDocument,
                                "([0-9]+) stereo cameras in a street \\(([0-9,]+) measurements\\) end at a "
                                "Huber cost of ([0-9.,]*[0-9]) in both");
  const auto kitti = published(kDocument,
                               "([0-9]+) keyframes that relmap's own front-end made of a KITTI drive "
                               "\\(([0-9,]+) measurements\\) at ([0-9.,]*[0-9]) in both");
  const auto grown = published(kDocument, "the map as it grew has ([0-9.,]*[0-9]) and ([0-9.,]*[0-9])\\.");
  EXPECT_EQ(found["stereo_factors_frames"], street.at(0));
  EXPECT_EQ(found["stereo_factors_measurements"], street.at(1));
  EXPECT_NEAR(found["stereo_factors_cost_full"], street.at(2), 0.01);
  EXPECT_NEAR(found["stereo_factors_cost_ceres"], street.at(2), 0.01);
  EXPECT_NEAR(found["stereo_factors_cost_adaptive"], grown.at(0), 0.01);
  EXPECT_EQ(found["kitti_raw_frames"], kitti.at(0));
  EXPECT_EQ(found["kitti_raw_measurements"], kitti.at(1));
  EXPECT_NEAR(found["kitti_raw_cost_full"], kitti.at(2), 0.01);
  EXPECT_NEAR(found["kitti_raw_cost_ceres"], kitti.at(2), 0.01);
  EXPECT_NEAR(found["kitti_raw_cost_adaptive"], grown.at(1), 0.01);
}

const char* const kFrontEnd = "docs/frontend.md";

// Compares with the table's row that begins with `name`. Drift and rotation are of the same pictures each time, and
// differ between machines by rounding only.
void expect_drift_as_published(const BenchFigures& found, const std::string& name) {
  const auto row = published(kFrontEnd, "\\| " + name +
                                            "[^|]*\\| [0-9]+ \\| [0-9]+ \\| ([0-9.]+) \\| ([0-9.]+) \\| ([0-9.]+) "
                                            "\\| ([0-9.]+) \\|");
  const std::vector<double> measured{found["drift_percent"], found["reference_drift_percent"],
                                     found["rotation_deg_per_100m"], found["reference_rotation_deg_per_100m"]};
  for (std::size_t i = 0; i < measured.size(); ++i) EXPECT_NEAR(measured[i] / row.at(i), 1, 0.1) << name << ", " << i;
}

TEST_F(PublishedFiguresData, TheFrontEndDriftsOnKittiAsTheDocumentSays) {
  const auto run = [&](const std::string& recording, const std::vector<std::string>& more = {}) {
    std::vector<std::string> command{"frontend", "--source", "kitti", data_ + "/" + recording, "--reference", "klt"};
    command.insert(command.end(), more.begin(), more.end());
    return BenchFigures(command);
  };
  const BenchFigures street = run("kitti_raw_0926_1405"), road = run("kitti_odom_06_first51");
  expect_drift_as_published(road, "KITTI odometry 06, first 51 pairs");
  expect_drift_as_published(street, "KITTI raw 0926_1405, 160 pairs");
  expect_drift_as_published(run("kitti_raw_0926_1405", {"--first", "48"}), "the same from pair 48 on");
  EXPECT_NEAR(street["apart_percent"], published_figure(kFrontEnd, "each other by ([0-9.]+) % \\(`apart_percent`\\)"),
              0.03);
  EXPECT_NEAR(-road["offset_px"], published_figure(kFrontEnd, "disparities that are ([0-9.]+) px too small"), 0.05);
  const auto inliers = published(kFrontEnd,
                                 "([0-9.]+) px on KITTI 0926_1405 with ([0-9]+) % and ([0-9.]+) px on KITTI 06 with "
                                 "([0-9]+) %");
  EXPECT_NEAR(street["reprojection_px"], inliers.at(0), 0.02);
  EXPECT_NEAR(100 * street["inlier_share"], inliers.at(1), 2);
  EXPECT_NEAR(road["reprojection_px"], inliers.at(2), 0.02);
  EXPECT_NEAR(100 * road["inlier_share"], inliers.at(3), 2);
}

}  // namespace
}  // namespace relmap::testing
