// The short form of `relmap-bench ingest`: keyframes of rendered pictures, through a daemon, until all are looked up.
#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <vector>

#include "storage/testing/temporary_folder.h"
#include "tests/support/bench_figures.h"
#include "tests/support/process.h"

namespace relmap::testing {
namespace {

TEST(Ingest, AnyNumberOfLookupThreadsAndOfRobotsFindTheSame) {
  const storage::TemporaryFolder folder;
  const std::string drive = folder / "drive", keyframes = folder / "drive.bin";
  for (const std::vector<std::string>& command : std::vector<std::vector<std::string>>{
           {built_program("relmap-sim"), "pictures", "--out", drive, "--pairs", "150", "--laps", "1.5", "--width",
            "400"},
           {built_program("relmap-frontend"), "--source", "sim", drive, "--robot", "r", "--out", keyframes}}) {
    const Finished made = run_program(command, std::chrono::seconds(300));
    ASSERT_EQ(made.exit_code, 0) << made.standard_error;
  }
  const auto ingest = [&](const char* sessions, const char* threads) {
    return BenchFigures(
        {"ingest", "--pictures", keyframes, "--truth", drive, "--sessions", sessions, "--lookup-threads", threads},
        std::chrono::seconds(300));
  };
  const BenchFigures one = ingest("1", "1"), many = ingest("1", "3"), robots = ingest("4", "2");
  EXPECT_GT(one["keyframes"], 50);
  EXPECT_GT(one["closures"], 0.2 * one["keyframes"]) << "of a third that return";
  EXPECT_EQ(one["wrong"], 0);
  // What a lookup sees in force depends on when it is made, and so does a closure in a hundred.
  EXPECT_NEAR(many["closures"], one["closures"], 1);
  EXPECT_EQ(many["wrong"], 0);
  EXPECT_EQ(robots["keyframes"], 4 * one["keyframes"]);
  EXPECT_GT(robots["closures"], 3 * one["keyframes"]) << "all but the first of four find frames of those before";
  EXPECT_EQ(robots["wrong"], 0);
  // Most observations lead across closures; the robots' own steps stay as exact as they were.
  EXPECT_LT(one["worst_step_m"], 0.02);
  EXPECT_LT(robots["worst_step_m"], 0.2);
}

}  // namespace
}  // namespace relmap::testing
