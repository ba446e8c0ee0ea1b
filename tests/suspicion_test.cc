// Wrong closures that an operator put into force are found by their suspicion (docs/evidence.md).
#include <gtest/gtest.h>

#include "tests/support/bench_figures.h"

namespace relmap::testing {
namespace {

// The curves were chosen on seeds below 11.
TEST(SuspicionRanking, TenPlantedClosuresAreAmongTheFirstFifteen) {
  const BenchFigures found({"suspicion", "--first-seed", "11"});
  EXPECT_EQ(found["planted"], 10);
  EXPECT_GE(found.series("true_of_seed").at(0), 60);
  EXPECT_EQ(found["first_15"], 10);
}

}  // namespace
}  // namespace relmap::testing
