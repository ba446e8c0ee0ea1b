// relmap ingest: many recordings into one map, and what interruptions of any kind leave of it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <random>

#include "storage/testing/temporary_folder.h"
#include "tests/support/process.h"
#include "tests/support/running_daemon.h"
#include "tests/support/stored_map.h"

namespace relmap::testing {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;

// Keyframes of a drive among points, ready made: the same world, other noise.
std::string drive(const TemporaryFolder& folder, int noise) {
  const std::string path = folder / ("drive-" + std::to_string(noise));
  const Finished made =
      run_program({built_program("relmap-sim"), "points", "--out", path, "--frames", "150", "--frames-per-lap", "100",
                   "--appearance", "100", "--noise-seed", std::to_string(noise)});
  EXPECT_EQ(made.exit_code, 0) << made.standard_error;
  return path;
}

class BatchIngest : public ::testing::Test {
 protected:
  void SetUp() override {
    for (const int noise : {1, 2, 3}) drives_.push_back(drive(folder_, noise));
  }

  DaemonOptions daemon_options(const std::string& data, bool deterministic) const {
    DaemonOptions options;
    options.data = folder_ / data;
    if (deterministic) options.more = {"--deterministic"};
    return options;
  }
  std::vector<std::string> command(const std::string& server, const std::vector<std::string>& more = {}) const {
    std::vector<std::string> command = {built_program("relmap"), "--server", server, "--json", "ingest"};
    command.insert(command.end(), drives_.begin(), drives_.end());
    command.insert(command.end(), more.begin(), more.end());
    return command;
  }
  static Finished run(const std::vector<std::string>& command) {
    setenv("XDG_STATE_HOME", (std::filesystem::temp_directory_path() / "relmap-batch-test").c_str(), 1);
    return run_program(command, seconds(50));
  }
  MapHash hash_of(const DaemonOptions& options) const { return hash_map(*open_stored_map(options.data)); }

  // The map of a batch that was interrupted: relmap killed, and asked to end, with its front-ends; the daemon killed.
  MapHash interrupted_map(const DaemonOptions& options, const std::vector<std::string>& more, unsigned seed) {
    std::mt19937 random(seed);
    auto daemon = std::make_unique<RunningDaemon>(options);
    for (int interruption = 0; interruption < 6; ++interruption) {
      Process batch(command(options.data, more), {});
      const bool over = batch.wait(milliseconds(100 + random() % 700)).has_value();
      if (interruption % 3 == 0) {
        batch.kill();
      } else if (interruption % 3 == 1) {
        batch.signal(SIGTERM);
        EXPECT_TRUE(batch.wait(seconds(20)));
      } else {
        daemon->process().kill();
        daemon = std::make_unique<RunningDaemon>(options);
        if (random() % 2) batch.kill();
        EXPECT_TRUE(batch.wait(seconds(50)));
      }
      if (over) break;
    }
    const Finished last = run(command(options.data, more));
    EXPECT_EQ(last.exit_code, 0) << last.standard_error;
    EXPECT_EQ(daemon->stop(), 0);
    return hash_of(options);
  }

  const TemporaryFolder folder_;
  std::vector<std::string> drives_;
};

TEST_F(BatchIngest, TakesInWhatIsThereNamesWhatIsNotAndNeverTakesInTwice) {
  const DaemonOptions options = daemon_options("map", false);
  RunningDaemon daemon(options);
  std::filesystem::create_directories(folder_ / "empty");
  drives_.push_back(folder_ / "empty");
  const Finished first = run(command(options.data, {"--jobs", "2"}));
  EXPECT_EQ(first.exit_code, 1);
  EXPECT_THAT(first.standard_error, HasSubstr("1 of 4 recordings failed"));
  EXPECT_THAT(first.standard_output, HasSubstr("\"failed\":1"));
  EXPECT_THAT(first.standard_output, HasSubstr("\"state\":\"done\""));
  auto sessions = daemon.client()->sessions().or_throw();
  ASSERT_EQ(sessions.size(), 3u);
  for (const client::Session& session : sessions) {
    EXPECT_EQ(session.frames, 150u);
    EXPECT_EQ(session.state, client::SessionState::kEnded);
    EXPECT_NE(session.name.find("/drive-"), std::string::npos) << session.name;
  }

  drives_.pop_back();
  const Finished again = run(command(options.data));
  EXPECT_EQ(again.exit_code, 0) << again.standard_error;
  EXPECT_THAT(again.standard_output, HasSubstr("\"state\":\"was there\""));
  EXPECT_EQ(daemon.client()->sessions()->size(), 3u);

  drives_.resize(1);
  EXPECT_EQ(run(command(options.data, {"--again"})).exit_code, 0);
  EXPECT_EQ(daemon.client()->sessions()->size(), 4u);

  const Finished random_order = run(command(options.data, {"--deterministic"}));
  EXPECT_EQ(random_order.exit_code, 1);
  EXPECT_THAT(random_order.standard_error, HasSubstr("relmapd --deterministic"));
  EXPECT_EQ(run(command("127.0.0.1:1")).exit_code, 3);
}

TEST_F(BatchIngest, InterruptedItGivesTheSameFramesAndTracks) {
  const DaemonOptions whole = daemon_options("whole", false), broken = daemon_options("broken", false);
  {
    RunningDaemon daemon(whole);
    ASSERT_EQ(run(command(whole.data)).exit_code, 0);
    ASSERT_EQ(daemon.stop(), 0);
  }
  (void)interrupted_map(broken, {}, 1);
  const auto map = open_stored_map(whole.data), other = open_stored_map(broken.data);
  ASSERT_EQ(map->sessions().size(), other->sessions().size());
  for (const Session& session : map->sessions()) {
    const auto& all = other->sessions();
    const auto same =
        std::find_if(all.begin(), all.end(), [&](const Session& s) { return s.header.uuid == session.header.uuid; });
    ASSERT_NE(same, all.end());
    EXPECT_EQ(same->frames, session.frames);
    for (std::uint32_t i = 0; i < session.next_sequence; ++i) {
      const auto hot = map->hot({session.number, i}), other_hot = other->hot({same->number, i});
      ASSERT_TRUE(hot && other_hot);
      EXPECT_EQ(hot->payload_crc, other_hot->payload_crc) << "tracks stand in the payload";
    }
  }
}

TEST_F(BatchIngest, DeterministicItGivesTheSameMapToTheLastBitHoweverOftenItIsInterrupted) {
  const DaemonOptions whole = daemon_options("whole", true), broken = daemon_options("broken", true);
  {
    RunningDaemon daemon(whole);
    const Finished done = run(command(whole.data, {"--deterministic"}));
    ASSERT_EQ(done.exit_code, 0) << done.standard_error;
    ASSERT_EQ(daemon.stop(), 0);
  }
  const MapHash hash = hash_of(whole);
  EXPECT_EQ(interrupted_map(broken, {"--deterministic"}, 2), hash);
}

}  // namespace
}  // namespace relmap::testing
