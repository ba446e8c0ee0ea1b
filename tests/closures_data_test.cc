// Loops that appearance proposed for recorded drives, many of them false, are accepted or refused by a map in their
// order.
#include <gtest/gtest.h>

#include <string>

#include "tests/support/bench_figures.h"
#include "tests/support/data_test.h"

namespace relmap::testing {
namespace {

class ClosuresData : public DataTest {
 protected:
  std::string graph(const std::string& name) const { return data_ + "/posegraphs/" + name; }
};

// GPS tells true loops (ends less than 3 m apart) from false ones (more than 10 m).
TEST_F(ClosuresData, OfBovisaFalseLoopsAreRefusedAndTrueOnesKept) {
  const BenchFigures bovisa({"closures", graph("Bovisa04_odometry_bow_tr.g2o"), "--truth", graph("Bovisa04_GT_GPS.g2o"),
                             "--truth-every", "10"});
  EXPECT_EQ(bovisa["true_loops"], 70);
  EXPECT_EQ(bovisa["false_loops"], 79);
  EXPECT_GE(bovisa["false_refused"], 76);
  EXPECT_GE(bovisa["true_kept"], 67);
}

// There is no truth: it is only known how many loops agree with the motion.
TEST_F(ClosuresData, OfNewCollegeWhatContradictsMotionIsRefused) {
  const BenchFigures college({"closures", graph("NewCollege_odometry_bow_tr.g2o")});
  EXPECT_EQ(college["frames"], 12816);
  EXPECT_EQ(college["loops"], 641);
  EXPECT_EQ(college["self_edges"], 9) << "each refused by name (import_g2o_test)";
  EXPECT_GE(college["contradicted"], 50);
  EXPECT_GE(college["kept"], 555);
  EXPECT_LE(college["kept"] + college["contradicted"] + college["quarantined"], college["loops"]);
}

}  // namespace
}  // namespace relmap::testing
