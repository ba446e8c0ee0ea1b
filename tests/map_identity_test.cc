// A map has an identity, and sessions that began in one map do not continue in another: recordings are sent from their
// beginning, and live robots are told. A restored map gets the missing keyframes that spools still have; the others are
// declared as gaps.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <string>
#include <vector>

#include "storage/testing/temporary_folder.h"
#include "tests/support/process.h"
#include "tests/support/running_daemon.h"

namespace relmap::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr std::uint32_t kFrames = 120;

class MapIdentityTest : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_EQ(run_program({built_program("relmap-sim"), "points", "--out", drive_, "--frames", std::to_string(kFrames),
                           "--frames-per-lap", "100", "--appearance", "100"})
                  .exit_code,
              0);
  }
  DaemonOptions daemon_of(const std::string& map, const std::string& lcm = {}) const {
    return {.data = folder_ / map, .lcm = lcm, .more = {"--backup-root", folder_ / ""}};
  }
  std::vector<std::string> command(std::vector<std::string> more) const {
    std::vector<std::string> all{built_program("relmap-frontend"),
                                 drive_,
                                 "--robot",
                                 "cart",
                                 "--session",
                                 "morning",
                                 "--spool",
                                 folder_ / "spool"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  Finished send(std::vector<std::string> more) const { return run_program(command(std::move(more))); }
  Finished admin(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), built_program("relmap-admin"));
    return run_program(arguments);
  }
  static std::vector<client::Session> sessions_of(const RunningDaemon& daemon) {
    const auto client = daemon.client();
    EXPECT_TRUE(client->wait_idle().ok());
    return client->sessions().or_throw();
  }
  static void expect_whole(const RunningDaemon& daemon) {
    const auto sessions = sessions_of(daemon);
    ASSERT_EQ(sessions.size(), 1u);
    EXPECT_EQ(sessions[0].frames, kFrames);
    EXPECT_EQ(daemon.client()->status().or_throw().gaps, 0u);
  }

  const storage::TemporaryFolder folder_;
  const std::string drive_ = folder_ / "drive";
};

TEST_F(MapIdentityTest, IsKeptOverRestartsAndShown) {
  const DaemonOptions options = daemon_of("map");
  MapIdentity map;
  {
    RunningDaemon daemon(options);
    map = daemon.client()->status().or_throw().map;
    EXPECT_TRUE(map.known());
    daemon.process().kill();  // at once: it was durable before it was told
  }
  {
    RunningDaemon daemon(options);
    EXPECT_EQ(daemon.client()->status().or_throw().map, map);
    EXPECT_EQ(daemon.stop(), 0);
  }
  EXPECT_THAT(admin({"--json", "stats", options.data}).standard_output, HasSubstr(map.uuid.to_string()));
  RunningDaemon other(daemon_of("other"));
  EXPECT_NE(other.client()->status().or_throw().map.uuid, map.uuid);
}

// A keyframe of the drive would otherwise be followed by a gap of all that the other map has.
TEST_F(MapIdentityTest, ARecordingBeginsAnewInAnotherMapAndIsNotDoubledInTheFirst) {
  RunningDaemon first(daemon_of("first")), second(daemon_of("second"));
  ASSERT_EQ(send({"--server", first.address()}).exit_code, 0);
  expect_whole(first);
  const Finished moved = send({"--server", second.address()});
  EXPECT_EQ(moved.exit_code, 0) << moved.standard_error;
  EXPECT_THAT(moved.standard_error, HasSubstr("was begun in map"));
  expect_whole(second);
  const Finished back = send({"--server", first.address()});
  EXPECT_EQ(back.exit_code, 0) << back.standard_error;
  expect_whole(first);
  EXPECT_EQ(sessions_of(first)[0].uuid, sessions_of(second)[0].uuid);
}

TEST_F(MapIdentityTest, ARecordingBeginsAnewInAnotherMapOverLcm) {
  const std::string lcm = random_lcm_url();
  {
    RunningDaemon first(daemon_of("first", lcm));
    ASSERT_EQ(send({"--lcm", lcm}).exit_code, 0);
    expect_whole(first);
    EXPECT_EQ(first.stop(), 0);
  }
  RunningDaemon second(daemon_of("second", lcm));
  const Finished moved = send({"--lcm", lcm});
  EXPECT_EQ(moved.exit_code, 0) << moved.standard_error;
  EXPECT_THAT(moved.standard_error, HasSubstr("was begun in map"));
  expect_whole(second);
}

TEST_F(MapIdentityTest, ALiveRobotIsToldAndKeepsItsKeyframes) {
  RunningDaemon first(daemon_of("first")), second(daemon_of("second"));
  {
    Process robot(command({"--server", first.address(), "--live", "--rate", "40"}), {});
    while (robot.running() && first.client()->status().or_throw().frames < 20)
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    robot.signal(SIGINT);
    EXPECT_EQ(robot.wait(kPatience), 4);
  }
  const Finished told = send({"--server", second.address(), "--live", "--rate", "100", "--patience", "1", "--json"});
  EXPECT_EQ(told.exit_code, 3) << told.standard_error;
  EXPECT_THAT(told.standard_error, HasSubstr("WRONG_MAP"));
  EXPECT_THAT(told.standard_error, HasSubstr("--session"));
  EXPECT_TRUE(sessions_of(second).empty());
  const Finished home = send({"--server", first.address(), "--live"});
  EXPECT_EQ(home.exit_code, 0) << home.standard_error;
  expect_whole(first);
}

TEST_F(MapIdentityTest, ARestoredMapGetsWhatTheSpoolHasAndNamesTheRestAsGaps) {
  const DaemonOptions options = daemon_of("map");
  MapIdentity before;
  {
    RunningDaemon daemon(options);
    before = daemon.client()->status().or_throw().map;
    ASSERT_EQ(admin({"backup", options.data, folder_ / "backup"}).exit_code, 0);  // before the session began
    Process robot(command({"--server", options.data, "--live", "--rate", "40"}), {});
    while (robot.running() && daemon.client()->status().or_throw().frames < 20)
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    robot.signal(SIGINT);
    EXPECT_EQ(robot.wait(kPatience), 4);
    // A process of its own begins a segment of its own.
    Process again(command({"--server", options.data, "--live", "--rate", "40"}), {});
    while (again.running() && daemon.client()->status().or_throw().frames < 60)
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    again.signal(SIGINT);
    EXPECT_EQ(again.wait(kPatience), 4);
    EXPECT_EQ(daemon.stop(), 0);
  }
  fs::remove_all(options.data);
  ASSERT_EQ(admin({"restore", folder_ / "backup", options.data}).exit_code, 0);
  ASSERT_TRUE(fs::remove(folder_ / "spool/0000000000.seg"));  // as when all in it was settled long ago

  RunningDaemon daemon(options);
  const MapIdentity after = daemon.client()->status().or_throw().map;
  EXPECT_EQ(after.uuid, before.uuid);
  EXPECT_GT(after.epoch, before.epoch);
  const Finished rest = send({"--server", options.data, "--live", "--json"});
  EXPECT_EQ(rest.exit_code, 3) << rest.standard_error;
  EXPECT_THAT(rest.standard_error, HasSubstr("MAP_RESTORED"));
  const auto sessions = sessions_of(daemon);
  ASSERT_EQ(sessions.size(), 1u);
  const auto gaps = daemon.client()->status().or_throw().gaps;
  EXPECT_GE(gaps, 20u);
  EXPECT_EQ(sessions[0].frames + gaps, kFrames);
}

TEST_F(MapIdentityTest, ARecordingIsWholeAgainInARestoredMap) {
  const DaemonOptions options = daemon_of("map");
  {
    RunningDaemon daemon(options);
    ASSERT_EQ(admin({"backup", options.data, folder_ / "backup"}).exit_code, 0);
    ASSERT_EQ(send({"--server", options.data}).exit_code, 0);
    EXPECT_EQ(daemon.stop(), 0);
  }
  fs::remove_all(options.data);
  ASSERT_EQ(admin({"restore", folder_ / "backup", options.data}).exit_code, 0);
  fs::remove_all(folder_ / "spool/0000000000.seg");
  RunningDaemon daemon(options);
  // What its spool has no more, the recording has.
  const Finished again = send({"--server", options.data});
  EXPECT_EQ(again.exit_code, 0) << again.standard_error;
  expect_whole(daemon);
}

// A run that resumes in the middle tracks from there anew and has other keyframes, which must not be appended to those
// of the first run.
TEST_F(MapIdentityTest, AnInterruptedRecordingIsNotPiecedTogetherFromTwoRuns) {
  const DaemonOptions options = daemon_of("map");
  const auto interrupted_at = [&](const RunningDaemon& daemon, std::uint64_t frames) {
    Process robot(command({"--server", options.data, "--rate", "40"}), {});
    while (robot.running() && daemon.client()->status().or_throw().frames < frames)
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    robot.signal(SIGINT);
    EXPECT_EQ(robot.wait(kPatience), 4);
  };
  std::uint64_t held = 0;
  {
    RunningDaemon daemon(options);
    interrupted_at(daemon, 20);
    interrupted_at(daemon, 50);
    ASSERT_TRUE(daemon.client()->wait_idle().ok());
    held = daemon.client()->status().or_throw().frames;
    ASSERT_EQ(admin({"backup", options.data, folder_ / "backup"}).exit_code, 0);
    EXPECT_EQ(daemon.stop(), 0);
  }
  fs::remove_all(options.data);
  ASSERT_EQ(admin({"restore", folder_ / "backup", options.data}).exit_code, 0);
  RunningDaemon daemon(options);
  const Finished again = send({"--server", options.data});
  EXPECT_EQ(again.exit_code, 0) << again.standard_error;
  const auto sessions = sessions_of(daemon);
  ASSERT_EQ(sessions.size(), 2u);
  EXPECT_EQ(sessions[0].frames, held);
  EXPECT_EQ(sessions[1].frames, kFrames);
  EXPECT_NE(sessions[1].uuid, sessions[0].uuid);
}

}  // namespace
}  // namespace relmap::testing
