// The adaptive relative solution against the full one (docs/method.md, 5; docs/rba.md).
#include <gtest/gtest.h>

#include <limits>

#include "tests/support/simulated_drive.h"

namespace relmap::testing {
namespace {

constexpr std::uint64_t kSeeds = 5;

struct Outcome {
  double registration_error_m = 0;  // sum over the seeds
  double active_frames = 0;         // mean over keyframes
};

// The figure eight, driven with other noise for each seed.
Outcome drive_figure8(const rba::RbaOptions& options) {
  Outcome sum;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    SimulatedDrive drive(sim::figure8_options(seed), options);
    drive.drive();
    sum.registration_error_m += drive.registration_error(4).mean_m;
    double active = 0;
    for (const DriveStep& step : drive.steps()) active += step.active_frames;
    sum.active_frames += active / drive.driven() / kSeeds;
  }
  return sum;
}

TEST(Figure8, AdaptiveSolutionIsNearlyAsGoodAsTheFullOne) {
  double odometry = 0, adaptive = 0, full = 0, revisit = 0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
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
    revisit = std::max(revisit, drive.revisit_error().mean_m);
  }
  std::printf("sum: odometry %.3f m, adaptive %.3f m, full %.3f m: %.4f times; revisits %.4f m at most\n", odometry,
              adaptive, full, adaptive / full, revisit);
  EXPECT_LT(full, 0.5 * odometry);
  EXPECT_LE(adaptive, 1.016 * full);
  EXPECT_LT(revisit, 0.05);

  // A region of one frame that grows where errors change loses little, and one that does not grow loses four times as
  // much. (From four frames on the window alone covers what a new keyframe disturbs: there the two cannot be told
  // apart.)
  rba::RbaOptions one_frame;
  one_frame.window = 1;
  const Outcome growing = drive_figure8(one_frame);
  one_frame.delta_eps = std::numeric_limits<double>::infinity();
  const Outcome fixed = drive_figure8(one_frame);
  std::printf("a window of one frame: growing %.4f times the full solution, %.2f frames; fixed %.4f times, %.2f\n",
              growing.registration_error_m / full, growing.active_frames, fixed.registration_error_m / full,
              fixed.active_frames);
  EXPECT_LE(growing.registration_error_m, 1.047 * full);
  EXPECT_GE(fixed.registration_error_m, 1.09 * full);
  EXPECT_NEAR(growing.active_frames, 2.8, 0.5);
}

}  // namespace
}  // namespace relmap::testing
