// What docs/rba.md says of recorded measurements (label data).
#include <gtest/gtest.h>

#include <cmath>

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

}  // namespace
}  // namespace relmap::testing
