// A small town of `relmap-bench vast`, with a kill: nothing is lost or doubled, and places seen before are recognised.
#include <gtest/gtest.h>

#include <chrono>
#include <string>

#include "storage/testing/temporary_folder.h"
#include "tests/support/bench_figures.h"
#include "tests/support/process.h"

namespace relmap::testing {
namespace {

TEST(Vast, ATownIsTakenInWholeThoughTheDaemonIsKilled) {
  const storage::TemporaryFolder folder;
  const std::string page = folder / "page.html";
  const BenchFigures figures({"vast", "--keyframes", "800", "--robots", "2", "--kills", "1", "--page", page},
                             std::chrono::seconds(500));
  EXPECT_EQ(figures["kills"], 1);
  EXPECT_EQ(figures["keyframes"], 800);
  EXPECT_EQ(figures["lost"], 0);
  EXPECT_EQ(figures["doubled"], 0);
  EXPECT_EQ(figures["disconnected"], 0);
  EXPECT_GT(figures["revisits"], 30);
  EXPECT_GE(figures["revisits_bound_share"], 0.8);
  EXPECT_GT(figures["closures_right"], 30);
  EXPECT_LE(figures["closures_wrong"], 0.01 * figures["closures_right"]);
  EXPECT_LT(figures["step_error_p50_m"], 0.0155) << "the odometry's own error";
  EXPECT_LT(figures["step_error_p99_m"], 0.05);
  EXPECT_EQ(figures["places_wrong"], 0);
  EXPECT_EQ(figures["carried_wrongly"], 0);
  EXPECT_NE(read_text(page).find("Beside the paper"), std::string::npos);
}

TEST(Vast, AnInterruptedRunGoesOnAndAnotherOneCannotUseItsFolder) {
  const storage::TemporaryFolder folder;
  const auto run = [&](const char* seed) {
    return run_program({built_program("relmap-bench"), "vast", "--keyframes", "200", "--robots", "2", "--kills", "0",
                        "--seed", seed, "--folder", folder / "run", "--json"},
                       std::chrono::seconds(300));
  };
  const auto first = run("1");
  ASSERT_EQ(first.exit_code, 0) << first.standard_error;
  const auto again = run("1");
  EXPECT_EQ(again.exit_code, 0) << again.standard_error;
  EXPECT_NE(again.standard_output.find("\"keyframes\":200,"), std::string::npos) << again.standard_output;
  EXPECT_NE(again.standard_output.find("\"doubled\":0,"), std::string::npos);
  const auto other = run("2");
  EXPECT_NE(other.exit_code, 0);
  EXPECT_NE(other.standard_error.find("holds another run"), std::string::npos) << other.standard_error;
}

// The run of docs/vast.md. It takes 20 minutes on two idle cores.
TEST(LongVast, AHundredThousandKeyframesAreOneMap) {
  const BenchFigures figures({"vast", "--keyframes", "100000", "--robots", "12", "--kills", "4"},
                             std::chrono::hours(3));
  EXPECT_EQ(figures["kills"], 4);
  EXPECT_EQ(figures["lost"], 0);
  EXPECT_EQ(figures["doubled"], 0);
  EXPECT_EQ(figures["disconnected"], 0);
  EXPECT_GT(figures["revisits"], 30'000);
  EXPECT_GE(figures["revisits_bound_share"], 0.9);
  EXPECT_LE(figures["closures_wrong"], 0.002 * figures["closures_right"]);
  EXPECT_LE(figures["places_wrong"], 0.01 * figures["places_found"]);
  EXPECT_EQ(figures["carried_wrongly"], 0);
  EXPECT_GE(figures["rides_closed"], 0.8 * figures["rides_returned"]);
  EXPECT_LT(figures["map_error_p50_m"], 0.05);
  EXPECT_LE(figures["update_p99_last_us"], 1.5 * figures["update_p99_first_us"]) << "constant time";
}

}  // namespace
}  // namespace relmap::testing
