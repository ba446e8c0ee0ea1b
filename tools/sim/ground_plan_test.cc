#include "tools/sim/ground_plan.h"

#include <gtest/gtest.h>

#include <cmath>

namespace relmap::sim {
namespace {

TEST(GroundPlan, IsClosedSmoothAndDrivenAtUnitSpeed) {
  for (const PlanShape shape : {PlanShape::kFigure8, PlanShape::kCircle, PlanShape::kRoundedRectangle}) {
    const GroundPlan plan(shape, 55.2);
    const double h = 1e-4;
    for (double s = 0; s < 2 * plan.length(); s += 0.37) {
      const PlanePose a = plan.at(s), b = plan.at(s + h);
      EXPECT_NEAR(std::hypot(b.x - a.x, b.z - a.z) / h, 1, 1e-3) << s;
      // The heading is along the path.
      EXPECT_NEAR((b.x - a.x) / h, std::sin(a.yaw), 1e-3) << s;
      EXPECT_NEAR((b.z - a.z) / h, std::cos(a.yaw), 1e-3) << s;
    }
    const PlanePose start = plan.at(0), end = plan.at(plan.length() - 1e-9);
    EXPECT_NEAR(start.x, end.x, 1e-6);
    EXPECT_NEAR(start.z, end.z, 1e-6);
  }
}

}  // namespace
}  // namespace relmap::sim
