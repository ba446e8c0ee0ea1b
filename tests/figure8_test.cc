// The adaptive relative solution against the full one (docs/method.md, 5).
#include <gtest/gtest.h>

#include "tests/support/simulated_drive.h"

namespace relmap::testing {
namespace {

TEST(Figure8, AdaptiveSolutionIsNearlyAsGoodAsTheFullOne) {
  double odometry = 0, adaptive = 0, full = 0;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    SimulatedDrive drive(sim::figure8_options(seed), rba::RbaOptions());
    drive.drive();
    odometry += drive.odometry_registration_error(4).mean_m;
    const double one = drive.registration_error(4).mean_m;
    adaptive += one;
    const rba::RbaSummary summary = drive.relax_fully();
    EXPECT_EQ(summary.failures, 0U);
    const double best = drive.registration_error(4).mean_m;
    full += best;
    std::printf("seed %d: adaptive %.4f m, full %.4f m\n", static_cast<int>(seed), one, best);
    EXPECT_LT(drive.revisit_error().mean_m, 0.05);
  }
  std::printf("sum: odometry %.3f m, adaptive %.3f m, full %.3f m\n", odometry, adaptive, full);
  EXPECT_LT(full, 0.5 * odometry);
  EXPECT_LE(adaptive, 1.3 * full);
}

}  // namespace
}  // namespace relmap::testing
