// A small town of `relmap-bench vast`, with a kill: nothing is lost or doubled, and places seen before are recognised.
#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "client/relmap_client.h"
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
  EXPECT_EQ(figures["findings"], 0);
  EXPECT_GT(figures["revisits"], 30);
  EXPECT_GE(figures["revisits_bound_share"], 0.8);
  EXPECT_GT(figures["closures_right"], 30);
  EXPECT_LE(figures["closures_wrong"], 0.01 * figures["closures_right"]);
  EXPECT_LT(figures["step_error_p50_m"], 0.75 * figures["own_step_error_p50_m"]);
  EXPECT_LT(figures["step_error_p99_m"], 0.05);
  EXPECT_EQ(figures["places_wrong"], 0);
  EXPECT_EQ(figures["carried_wrongly"], 0);
  EXPECT_NE(read_text(page).find("Beside the paper"), std::string::npos);
}

TEST(Vast, AnInterruptedRunGoesOnAndAnotherOneCannotUseItsFolder) {
  const storage::TemporaryFolder folder;
  const std::string run = folder / "run", table = folder / "edges.tsv", picture = folder / "map.svg";
  const auto command = [&](const char* seed) {
    return std::vector<std::string>{built_program("relmap-bench"),
                                    "vast",
                                    "--light",
                                    "--keyframes",
                                    "1000",
                                    "--robots",
                                    "2",
                                    "--kills",
                                    "0",
                                    "--seed",
                                    seed,
                                    "--folder",
                                    run,
                                    "--edges",
                                    table,
                                    "--picture",
                                    picture,
                                    "--json"};
  };
  std::uint64_t interrupted_at = 0;
  {
    Process first(command("1"), {});
    const auto deadline = std::chrono::steady_clock::now() + kPatience;
    while (interrupted_at < 100 && first.running() && std::chrono::steady_clock::now() < deadline) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      const auto daemon = client::Client::connect(run + "/map");
      if (const auto status = daemon.ok() ? (*daemon)->status() : daemon.status(); status.ok())
        interrupted_at = status->frames;
    }
  }
  ASSERT_GE(interrupted_at, 100u);
  EXPECT_EQ(read_text(table), "") << "it has not come to its end";

  const auto again = run_program(command("1"), std::chrono::seconds(300));
  ASSERT_EQ(again.exit_code, 0) << again.standard_error;
  for (const char* figure : {"\"keyframes\":1000,", "\"lost\":0,", "\"doubled\":0,", "\"findings\":0,"})
    EXPECT_NE(again.standard_output.find(figure), std::string::npos) << figure << again.standard_output;
  EXPECT_NE(read_text(table).find("\nmotion\t1:0\t1:1\t"), std::string::npos) << read_text(table).substr(0, 500);
  EXPECT_NE(read_text(picture).find("</svg>"), std::string::npos);

  const auto other = run_program(command("2"), std::chrono::seconds(300));
  EXPECT_NE(other.exit_code, 0);
  EXPECT_NE(other.standard_error.find("holds another run"), std::string::npos) << other.standard_error;
}

TEST(Vast, ResultsThatCannotBeWrittenAreToldBeforeTheDrive) {
  const storage::TemporaryFolder folder;
  const auto refused = run_program({built_program("relmap-bench"), "vast", "--keyframes", "100", "--folder",
                                    folder / "run", "--edges", folder / "nowhere/edges.tsv"},
                                   std::chrono::seconds(300));
  EXPECT_NE(refused.exit_code, 0);
  EXPECT_NE(refused.standard_error.find("nowhere/edges.tsv cannot be written"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(folder / "run"));
}

// The run of docs/vast.md. It takes 20 minutes on two idle cores.
TEST(LongVast, AHundredThousandKeyframesAreOneMap) {
  const BenchFigures figures({"vast", "--keyframes", "100000", "--robots", "12", "--kills", "4"},
                             std::chrono::hours(3));
  EXPECT_EQ(figures["kills"], 4);
  EXPECT_EQ(figures["lost"], 0);
  EXPECT_EQ(figures["doubled"], 0);
  EXPECT_EQ(figures["disconnected"], 0);
  EXPECT_EQ(figures["findings"], 0);
  EXPECT_LE(figures["resident_mb"], 512 + 200);
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
