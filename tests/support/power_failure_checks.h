// The checks of every test of power failures.
#pragma once

#include <gtest/gtest.h>

#include "tests/support/power_failures.h"

namespace relmap::testing {

inline constexpr int kFailures = 25;  // a run

// Runs with power failures for `runs` seeds. `Disk` is a FailingDisk, constructed from a seed and whether it syncs.
template <typename Disk>
void fail_often(std::uint64_t first_seed, int runs) {
  for (std::uint64_t seed = first_seed; runs-- > 0; ++seed) {
    Disk disk(seed, true);
    const PowerFailureRun run = run_with_power_failures(disk, kFailures, seed);
    ASSERT_EQ(run.wrong, "") << "seed " << seed;
    EXPECT_GT(run.acknowledged_at_failures, 10u * kFailures) << "the failures came too early to tell anything";
    EXPECT_GT(run.commits, 5u);
    EXPECT_GT(run.closures_accepted, 0u);
  }
}

}  // namespace relmap::testing
