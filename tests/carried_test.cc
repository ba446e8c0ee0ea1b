// A robot that is carried without noticing closes its loop nevertheless, and only a relative map can keep measurements
// that no single frame fits (Sibley et al., 1 and 4.7). docs/rba.md, A train and a lift.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/support/bench_figures.h"
#include "tests/support/published.h"

namespace relmap::testing {
namespace {

const char* const kDocument = "docs/rba.md";
constexpr double kFactor = 1.08;  // the published figures are of five seeds

// The table's row with this name: train, lift.
std::vector<double> row(const std::string& name) {
  return published(kDocument, "\\| " + name + " \\| ([0-9.]+) \\| ([0-9.]+) \\|");
}

TEST(Carried, ByTrainAndLiftOnlyTheRelativeMapKeepsWhatWasMeasured) {
  const BenchFigures found({"rba", "--scenario", "lift", "--seeds", "2"});
  const auto floors = row("no loop closed: the noise floor"), locals = row("relative, loop closed"),
             graphs = row("the same edges as a pose graph in one frame, relaxed"),
             revisits = row("after the closing, seen from one lap before: relative"),
             graph_revisits = row("the same, pose graph");
  const std::vector<double> ridden{published_figure(kDocument, "boards a train for ([0-9.]+) m of it"),
                                   published_figure(kDocument, "takes the lift down ([0-9.]+) m,")};
  const std::string rides[] = {"train", "lift"};
  for (std::size_t i = 0; i < 2; ++i) {
    const std::string& ride = rides[i];
    const double local = found[ride + "_local_error_mm"], revisit = found[ride + "_revisit_error_mm"];
    EXPECT_NEAR(found[ride + "_unsensed_m"], ridden[i], 0.05) << ride;
    EXPECT_NEAR(found[ride + "_local_error_floor_mm"] / floors[i], 1, kFactor - 1) << ride;
    EXPECT_LE(local, kFactor * locals[i]) << ride;
    EXPECT_LE(local, 1.02 * found[ride + "_local_error_floor_mm"]) << ride << ": the loop costs nothing";
    EXPECT_GE(found[ride + "_local_error_pose_graph_mm"] / local, graphs[i] / locals[i] / kFactor) << ride;
    EXPECT_LE(revisit, kFactor * revisits[i]) << ride << ": the loop behind the ride is closed";
    EXPECT_GE(found[ride + "_revisit_error_pose_graph_mm"] / revisit, graph_revisits[i] / revisits[i] / kFactor)
        << ride;
  }
}

}  // namespace
}  // namespace relmap::testing
