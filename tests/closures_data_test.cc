// Loops that appearance proposed for recorded drives, many of them false, taken in and refused by a map as they came.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/support/data_test.h"
#include "tests/support/process.h"

namespace relmap::testing {
namespace {

class ReplayedClosures {
 public:
  explicit ReplayedClosures(const std::vector<std::string>& arguments) {
    std::vector<std::string> command{built_program("relmap-bench"), "closures", "--json"};
    command.insert(command.end(), arguments.begin(), arguments.end());
    const Finished done = run_program(command);
    if (done.exit_code != 0) throw std::runtime_error("relmap-bench closures: " + done.standard_error);
    figures_ = done.standard_output;
    std::printf("%s", figures_.c_str());
  }
  double operator[](const std::string& key) const {
    const std::string label = "\"" + key + "\": ";
    const std::size_t at = figures_.find(label);
    if (at == std::string::npos) throw std::runtime_error("no figure " + key);
    return std::strtod(figures_.c_str() + at + label.size(), nullptr);
  }

 private:
  std::string figures_;
};

class ClosuresData : public DataTest {
 protected:
  std::string graph(const std::string& name) const { return data_ + "/posegraphs/" + name; }
};

// GPS tells true loops (ends less than 3 m apart) from false ones (more than 10 m).
TEST_F(ClosuresData, OfBovisaFalseLoopsAreRefusedAndTrueOnesKept) {
  const ReplayedClosures bovisa(
      {graph("Bovisa04_odometry_bow_tr.g2o"), "--truth", graph("Bovisa04_GT_GPS.g2o"), "--truth-every", "10"});
  EXPECT_EQ(bovisa["true_loops"], 70);
  EXPECT_EQ(bovisa["false_loops"], 79);
  EXPECT_GE(bovisa["false_refused"], 0.95 * bovisa["false_loops"]);
  EXPECT_GE(bovisa["true_kept"], 0.9 * bovisa["true_loops"]);
}

// It has no truth: how many agree with the motion is all there is to be known.
TEST_F(ClosuresData, OfNewCollegeWhatContradictsMotionIsRefused) {
  const ReplayedClosures college({graph("NewCollege_odometry_bow_tr.g2o")});
  EXPECT_EQ(college["frames"], 12816);
  EXPECT_EQ(college["loops"], 641);
  EXPECT_EQ(college["self_edges"], 9) << "each refused by name (import_g2o_test)";
  EXPECT_GE(college["contradicted"], 50);
  EXPECT_GE(college["kept"], 500);
  EXPECT_LE(college["kept"] + college["contradicted"] + college["quarantined"], college["loops"]);
}

}  // namespace
}  // namespace relmap::testing
