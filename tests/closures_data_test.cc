// Loops that appearance proposed for recorded drives, many of them false, are accepted or refused by a map in their
// order.
#include <gtest/gtest.h>

#include <string>

#include "tests/support/bench_figures.h"
#include "tests/support/data_test.h"
#include "tests/support/published.h"

namespace relmap::testing {
namespace {

const char* const kDocument = "docs/figures.md";

class ClosuresData : public DataTest {
 protected:
  std::string graph(const std::string& name) const { return data_ + "/posegraphs/" + name; }
};

// GPS tells true loops (ends less than 3 m apart) from false ones (more than 10 m).
TEST_F(ClosuresData, OfBovisaFalseLoopsAreRefusedAndTrueOnesKept) {
  const BenchFigures bovisa({"closures", graph("Bovisa04_odometry_bow_tr.g2o"), "--truth", graph("Bovisa04_GT_GPS.g2o"),
                             "--truth-every", "10"});
  const auto loops = published(kDocument,
                               "of Bovisa04's ([0-9]+) false ones ([0-9]+) are refused, of its ([0-9]+) true ones "
                               "([0-9]+) kept");
  EXPECT_EQ(bovisa["false_loops"], loops.at(0));
  EXPECT_EQ(bovisa["false_refused"], loops.at(1));
  EXPECT_EQ(bovisa["true_loops"], loops.at(2));
  EXPECT_EQ(bovisa["true_kept"], loops.at(3));
}

// There is no truth: it is only known how many loops agree with the motion.
TEST_F(ClosuresData, OfNewCollegeWhatContradictsMotionIsRefused) {
  const BenchFigures college({"closures", graph("NewCollege_odometry_bow_tr.g2o")});
  const auto loops = published(kDocument,
                               "Of NewCollege's ([0-9]+), for which there is no ground truth, ([0-9]+) are kept and "
                               "([0-9]+) contradict the robot's motion; ([0-9]+) edges from a frame to itself");
  EXPECT_EQ(college["frames"], published_figure("README.md", "New College, ([0-9,]+) frames"));
  EXPECT_EQ(college["loops"], loops.at(0));
  EXPECT_EQ(college["kept"], loops.at(1));
  EXPECT_EQ(college["contradicted"], loops.at(2));
  EXPECT_EQ(college["self_edges"], loops.at(3)) << "each refused by name (import_g2o_test)";
  EXPECT_LE(college["kept"] + college["contradicted"] + college["quarantined"], college["loops"]);
}

}  // namespace
}  // namespace relmap::testing
