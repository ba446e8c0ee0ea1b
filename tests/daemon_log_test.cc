// relmapd's log at info level: robots that connect, begin, end and leave, edits, and what is recovered after a kill.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include "storage/testing/temporary_folder.h"
#include "tests/support/running_daemon.h"
#include "tests/support/simulated_recording.h"

namespace relmap::testing {
namespace {

using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(DaemonLog, SaysWhoConnectedAndWhatWasRecovered) {
  const storage::TemporaryFolder folder;
  const std::string drive = record_simulation(folder / "drive", {"--seed", "1", "--pairs", "20", "--laps", "0.1"});
  // Nothing is committed before the daemon is killed: all of it is recovered from the journal.
  std::ofstream(folder / "relmapd.yaml") << "commit_interval_ms: 600000\n";
  const DaemonOptions options{
      .data = folder / "map", .lcm = "", .more = {"--config", folder / "relmapd.yaml"}, .own_network = {}};
  std::uint64_t frames = 0;
  {
    RunningDaemon daemon(options);
    EXPECT_THAT(daemon.log(), Not(HasSubstr("recovered"))) << "the map is new";
    const Finished sent = run_program({built_program("relmap-frontend"), drive, "--robot", "cart", "--session",
                                       "morning", "--server", daemon.address(), "--spool", "none", "--quiet"});
    ASSERT_EQ(sent.exit_code, 0) << sent.standard_error;
    const auto client = daemon.client();
    ASSERT_TRUE(client->wait_idle().ok());
    ASSERT_TRUE(client->set_label({1, 0}, "dock").ok());
    frames = client->status().or_throw().frames;
    ASSERT_GT(frames, 2u);
    // A stream's end is told when both sides have let go of it.
    const auto deadline = std::chrono::steady_clock::now() + kPatience;
    while (daemon.log().find("is no longer connected") == std::string::npos &&
           std::chrono::steady_clock::now() < deadline)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    const std::string log = daemon.log();
    EXPECT_THAT(log, ContainsRegex("\\[info\\] robot cart \\(ipv[46]:[^)]*\\) has connected\n"));
    EXPECT_THAT(log, HasSubstr("[info] session 1 'morning' of robot cart begins\n"));
    EXPECT_THAT(log, HasSubstr("[info] robot cart sends keyframes for session 1 'morning'; the next is "));
    EXPECT_THAT(
        log, HasSubstr("[info] session 1 'morning' of robot cart has ended, " + std::to_string(frames) + " frames\n"));
    EXPECT_THAT(log, ContainsRegex("\\[info\\] robot cart \\(ipv[46]:[^)]*\\) is no longer connected\n"));
    EXPECT_THAT(log, HasSubstr("[info] operator: frame 1:0 is labelled 'dock'\n"));
    daemon.process().kill();
  }
  std::filesystem::remove(folder / "map.log");
  {
    RunningDaemon daemon(options);
    EXPECT_THAT(daemon.log(), ContainsRegex("\\[info\\] recovered: journal records 1 to [0-9]+ were applied again, " +
                                            std::to_string(frames) + " keyframes among them, in [0-9.]+ s\n"));
    EXPECT_EQ(daemon.client()->status().or_throw().frames, frames);
    EXPECT_EQ(daemon.stop(), 0);
  }
  RunningDaemon daemon(options);
  EXPECT_EQ(daemon.log().rfind("recovered"), daemon.log().find("recovered")) << "a stop leaves nothing to recover";
}

}  // namespace
}  // namespace relmap::testing
