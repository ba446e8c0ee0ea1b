#include "frontend/console.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace relmap::frontend {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(RunSummaryText, ZeroHasNoSign) {
  RunSummary summary;
  summary.offset_px = -0.0004;
  summary.rig.emplace();
  summary.rig->row_offset = summary.rig->row_slope_x = summary.rig->row_slope_y = summary.rig->disparity = -0.0;
  summary.rig->yaw_by_rows = -0.0001;
  summary.place.emplace();
  summary.place->T_frame_newest.t = {-0.0, -1e-9, -2};
  summary.camera.emplace();
  summary.camera->drift_ppm = -0.01;
  EXPECT_THAT(summary_text(summary), HasSubstr("0.0 m; disparities were 0.00 px off"));
  EXPECT_THAT(summary_text(summary), HasSubstr("its clock 0.0 ppm fast"));
  const std::string json = summary_json(summary);
  EXPECT_THAT(json, HasSubstr("\"translation\":[0,0,-2]"));
  EXPECT_THAT(json, HasSubstr("\"offset_px\":0,"));
  for (const std::string& text : {summary_text(summary), json}) {
    EXPECT_THAT(text, Not(HasSubstr("-0.0"))) << text;
    EXPECT_THAT(text, Not(HasSubstr("-0,"))) << text;
  }
}

}  // namespace
}  // namespace relmap::frontend
