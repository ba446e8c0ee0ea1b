// A robot that is carried without noticing closes its loop nevertheless, and only a relative map can keep measurements
// that no single frame fits (Sibley et al., 1 and 4.7). docs/rba.md, A train and a lift.
#include <gtest/gtest.h>

#include "tests/support/bench_figures.h"

namespace relmap::testing {
namespace {

TEST(Carried, ByTrainAndLiftOnlyTheRelativeMapKeepsWhatWasMeasured) {
  const BenchFigures found({"rba", "--scenario", "lift", "--seeds", "2"});
  for (const std::string ride : {"train", "lift"}) {
    const double local = found[ride + "_local_error_mm"], revisit = found[ride + "_revisit_error_mm"];
    EXPECT_LE(local, 8.5) << ride;
    EXPECT_LE(local, 1.02 * found[ride + "_local_error_floor_mm"]) << ride << ": the loop costs nothing";
    EXPECT_GE(found[ride + "_local_error_pose_graph_mm"], (ride == "train" ? 5.5 : 3) * local) << ride;
    EXPECT_LE(revisit, 5.5) << ride << ": the loop behind the ride is closed";
    EXPECT_GE(found[ride + "_revisit_error_pose_graph_mm"], 1.5 * revisit) << ride;
  }
}

}  // namespace
}  // namespace relmap::testing
