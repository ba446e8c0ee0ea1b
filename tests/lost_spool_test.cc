// A robot that lost its spool begins a new session of the same name, which is connected once a place is recognised.
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "storage/testing/temporary_folder.h"
#include "tests/support/process.h"
#include "tests/support/running_daemon.h"
#include "tests/support/stored_map.h"
#include "tests/support/world_truth.h"

namespace relmap::testing {
namespace {

TEST(LostSpool, ANewSessionBeginsAndIsJoinedToTheFirst) {
  const storage::TemporaryFolder folder;
  DaemonOptions options;
  options.data = folder / "map";
  options.more = {"--deterministic"};
  RunningDaemon daemon(options);
  const std::string spool = folder / "spool";
  // The same way twice, as one world is driven through.
  for (const std::string noise : {"1", "2"}) {
    const std::string drive = folder / ("drive-" + noise);
    const Finished made = run_program({built_program("relmap-sim"), "points", "--out", drive, "--frames", "150",
                                       "--frames-per-lap", "100", "--appearance", "100", "--noise-seed", noise});
    ASSERT_EQ(made.exit_code, 0) << made.standard_error;
    const Finished sent = run_program({built_program("relmap-frontend"), drive, "--robot", "cart", "--session",
                                       "morning", "--server", options.data, "--spool", spool});
    ASSERT_EQ(sent.exit_code, 0) << sent.standard_error;
    ASSERT_TRUE(daemon.client()->wait_idle().ok());
    ASSERT_GT(std::filesystem::remove_all(spool), 0u);
  }

  const auto sessions = daemon.client()->sessions().or_throw();
  ASSERT_EQ(sessions.size(), 2u);
  EXPECT_EQ(sessions[0].name, "morning");
  EXPECT_EQ(sessions[1].name, "morning#2");
  EXPECT_NE(sessions[0].uuid, sessions[1].uuid);
  for (const client::Session& session : sessions) {
    EXPECT_EQ(session.robot, "cart");
    EXPECT_EQ(session.frames, 150u);
  }
  ASSERT_EQ(daemon.stop(), 0);
  EXPECT_EQ(joined_sessions(*open_stored_map(options.data)), (std::vector<std::vector<SessionNumber>>{{1, 2}}));
}

}  // namespace
}  // namespace relmap::testing
