// relmap ingest of many recordings into one map, with interruptions of every kind.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <optional>
#include <random>
#include <thread>
#include <tuple>

#include "frontend/recording/testing/log_writer.h"
#include "storage/testing/temporary_folder.h"
#include "tests/support/process.h"
#include "tests/support/running_daemon.h"
#include "tests/support/stored_map.h"

namespace relmap::testing {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::Contains;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::Not;

struct Load {
  int drives, frames, frames_per_lap, appearance;
  int interruptions;
  seconds patience;
};

// Keyframes of drives among points, ready made: the same world, other noise.
class BatchIngest : public ::testing::Test {
 protected:
  explicit BatchIngest(const Load& load = {3, 80, 55, 100, 6, kPatience}) : load_(load) {}

  void SetUp() override {
    setenv("XDG_STATE_HOME", (folder_ / "state").c_str(), 1);
    for (int noise = 1; noise <= load_.drives; ++noise) {
      drives_.push_back(folder_ / ("drive-" + std::to_string(noise)));
      const Finished made =
          run_program({built_program("relmap-sim"), "points", "--out", drives_.back(), "--frames",
                       std::to_string(load_.frames), "--frames-per-lap", std::to_string(load_.frames_per_lap),
                       "--appearance", std::to_string(load_.appearance), "--noise-seed", std::to_string(noise)},
                      load_.patience);
      ASSERT_EQ(made.exit_code, 0) << made.standard_error;
    }
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
  Finished run(const std::vector<std::string>& command) const { return run_program(command, load_.patience); }

  // The map of a batch without interruptions; sets `took` to its duration.
  void make_whole(const DaemonOptions& options, const std::vector<std::string>& more, milliseconds& took) const {
    RunningDaemon daemon(options);
    const auto begin = std::chrono::steady_clock::now();
    const Finished done = run(command(options.data, more));
    took = std::chrono::duration_cast<milliseconds>(std::chrono::steady_clock::now() - begin);
    ASSERT_EQ(done.exit_code, 0) << done.standard_error;
    ASSERT_EQ(daemon.stop(), 0);
  }
  // The map of a batch that is interrupted at random moments within about half of `took`: relmap and its front-ends are
  // killed or sent SIGTERM, and the daemon is killed.
  void make_interrupted(const DaemonOptions& options, const std::vector<std::string>& more, milliseconds took,
                        unsigned seed) const {
    std::mt19937 random(seed);
    std::uniform_int_distribution<std::int64_t> moment(0, took.count() / load_.interruptions);
    auto daemon = std::make_unique<RunningDaemon>(options);
    std::optional<Process> batch;
    int interrupted = 0;
    for (bool over = false; interrupted < load_.interruptions; ++interrupted) {
      if (!batch) batch.emplace(command(options.data, more), ProcessOptions{});
      if (const auto code = batch->wait(milliseconds(moment(random)))) {
        over = *code == 0;
        batch.reset();
        if (over) break;
      } else if (interrupted % 3 == 0) {
        batch->kill();
        batch.reset();
      } else if (interrupted % 3 == 1) {
        batch->signal(SIGTERM);
        EXPECT_TRUE(batch->wait(kPatience));
        batch.reset();
      } else {  // relmap goes on when it is back
        daemon->process().kill();
        daemon = std::make_unique<RunningDaemon>(options);
      }
    }
    if (batch) {
      EXPECT_TRUE(batch->wait(load_.patience));
    }
    EXPECT_GE(interrupted, load_.interruptions / 2) << "it was over too soon to be interrupted";
    const Finished last = run(command(options.data, more));
    EXPECT_EQ(last.exit_code, 0) << last.standard_error;
    EXPECT_EQ(daemon->stop(), 0);
  }

  void expect_same_frames() const {
    const DaemonOptions whole = daemon_options("whole", false), broken = daemon_options("broken", false);
    milliseconds took{};
    ASSERT_NO_FATAL_FAILURE(make_whole(whole, {}, took));
    make_interrupted(broken, {}, took, 1);
    const auto map = open_stored_map(whole.data), other = open_stored_map(broken.data);
    ASSERT_EQ(map->sessions().size(), static_cast<std::size_t>(load_.drives));
    ASSERT_EQ(other->sessions().size(), map->sessions().size());
    for (const storage::Session& session : map->sessions()) {
      const auto& all = other->sessions();
      const auto same = std::find_if(all.begin(), all.end(),
                                     [&](const storage::Session& s) { return s.header.uuid == session.header.uuid; });
      ASSERT_NE(same, all.end());
      EXPECT_EQ(session.frames, frames());
      EXPECT_EQ(same->frames, session.frames);
      for (std::uint32_t i = 0; i < session.next_sequence; ++i) {
        const auto hot = map->hot({session.number, i}), other_hot = other->hot({same->number, i});
        ASSERT_TRUE(hot && other_hot);
        ASSERT_EQ(hot->payload_crc, other_hot->payload_crc) << "tracks stand in the payload";
      }
    }
  }
  void expect_same_map() const {
    const DaemonOptions whole = daemon_options("whole", true), broken = daemon_options("broken", true);
    milliseconds took{};
    ASSERT_NO_FATAL_FAILURE(make_whole(whole, {"--deterministic"}, took));
    const storage::MapHash hash = storage::hash_map(*open_stored_map(whole.data));
    make_interrupted(broken, {"--deterministic"}, took, 2);
    EXPECT_EQ(storage::hash_map(*open_stored_map(broken.data)), hash);
  }

  std::uint32_t frames() const { return static_cast<std::uint32_t>(load_.frames); }  // of each session

  const Load load_;
  const storage::TemporaryFolder folder_;
  std::vector<std::string> drives_;
};

TEST_F(BatchIngest, TakesRecordingsInOnceAndNamesMissingPaths) {
  const DaemonOptions options = daemon_options("map", false);
  RunningDaemon daemon(options);
  std::filesystem::create_directories(folder_ / "empty");
  drives_.push_back(folder_ / "empty");
  drives_.insert(drives_.begin(), folder_ / "nowhere");
  const Finished first = run(command(options.data, {"--jobs", "2"}));
  EXPECT_EQ(first.exit_code, 1);
  EXPECT_THAT(first.standard_error, HasSubstr("/nowhere: NO_SUCH_FILE: "));
  EXPECT_THAT(first.standard_error, HasSubstr("2 of 5 recordings failed"));
  EXPECT_THAT(first.standard_output, HasSubstr("\"failed\":2"));
  EXPECT_THAT(first.standard_output, HasSubstr("\"state\":\"done\""));
  auto sessions = daemon.client()->sessions().or_throw();
  ASSERT_EQ(sessions.size(), 3u);
  for (const client::Session& session : sessions) {
    EXPECT_EQ(session.frames, frames());
    EXPECT_EQ(session.state, client::SessionState::kEnded);
    EXPECT_NE(session.name.find("/drive-"), std::string::npos) << session.name;
  }

  drives_.pop_back();
  drives_.erase(drives_.begin());
  const Finished again = run(command(options.data));
  EXPECT_EQ(again.exit_code, 0) << again.standard_error;
  EXPECT_THAT(again.standard_output, HasSubstr("\"state\":\"was there\""));
  EXPECT_EQ(daemon.client()->sessions()->size(), 3u);
  EXPECT_EQ(run({built_program("relmap"), "--server", options.data, "session", "freeze", "1"}).exit_code, 0);
  const Finished frozen = run(command(options.data));
  EXPECT_EQ(frozen.exit_code, 0) << "it had ended before: " << frozen.standard_error;
  EXPECT_THAT(frozen.standard_output, Not(HasSubstr("\"state\":\"done\"")));

  const std::string deleted_drive = drives_[0];
  drives_ = {drives_[1]};
  EXPECT_EQ(run(command(options.data, {"--again"})).exit_code, 0);
  EXPECT_EQ(daemon.client()->sessions()->size(), 4u);
  drives_ = {deleted_drive};

  // A deleted session is neither taken in again nor reported as done.
  const auto of_first = std::find_if(sessions.begin(), sessions.end(),
                                     [](const client::Session& s) { return s.name.ends_with("/drive-1"); });
  ASSERT_NE(of_first, sessions.end());
  const std::string number = std::to_string(of_first->number);  // two were taken in at a time
  EXPECT_EQ(run({built_program("relmap"), "--server", options.data, "session", "delete", number, "--yes"}).exit_code,
            0);
  ASSERT_TRUE(daemon.client()->wait_idle().ok());
  const Finished deleted = run(command(options.data));
  EXPECT_EQ(deleted.exit_code, 1);
  EXPECT_THAT(deleted.standard_output, HasSubstr("\"state\":\"failed\""));
  EXPECT_THAT(deleted.standard_output, HasSubstr("SESSION_DELETED"));
  EXPECT_THAT(deleted.standard_output, HasSubstr("deleted from the map; --again takes it in as a new session\""));
  EXPECT_THAT(deleted.standard_error,
              HasSubstr("1 was deleted from the map; relmap ingest --again takes it in as another session\n"));

  const Finished random_order = run(command(options.data, {"--deterministic"}));
  EXPECT_EQ(random_order.exit_code, 1);
  EXPECT_THAT(random_order.standard_error, HasSubstr("relmapd --deterministic"));
  EXPECT_EQ(run(command("127.0.0.1:1")).exit_code, 3);
}

// Two robots' sessions in a log that lcm-logger split.
TEST_F(BatchIngest, ALogBecomesTheSessionsThatWereRecordedOnce) {
  const DaemonOptions options = daemon_options("map", false);
  RunningDaemon daemon(options);
  std::vector<std::string> uuids;
  std::vector<std::vector<Keyframe>> recorded;
  for (const int robot : {0, 1}) {
    recorded.push_back(read_keyframes(drives_[robot] + "/keyframes.bin"));
    const SessionUuid uuid = *SessionUuid::parse("2110000" + std::to_string(robot) + "-2222-4333-8444-555555555555");
    for (Keyframe& keyframe : recorded[robot]) {
      keyframe.session.uuid = uuid;
      keyframe.session.robot = "cart-" + std::to_string(robot);
    }
    uuids.push_back(uuid.to_string());
  }
  drives_.clear();
  for (const auto& [name, first, end] : {std::tuple{"lcmlog.00", 0, 50}, {"lcmlog.01", 50, load_.frames}}) {
    drives_.push_back(folder_ / name);
    recording::LogWriter log(drives_.back());
    for (int i = first; i < end; ++i)
      for (const auto& keyframes : recorded) log.write(recording::to_messages(keyframes[static_cast<std::size_t>(i)]));
  }

  const Finished listed = run({built_program("relmap-frontend"), "--source", "log", drives_[1], "--list"});
  EXPECT_EQ(listed.exit_code, 0) << listed.standard_error;
  for (const std::string& uuid : uuids)
    EXPECT_THAT(listed.standard_output, ContainsRegex("\"uuid\":\"" + uuid + "\".*\"first\":50,\"last\":79"));

  const auto expect_all_there = [&] {
    const auto sessions = daemon.client()->sessions().or_throw();
    ASSERT_EQ(sessions.size(), 2u);
    for (const client::Session& session : sessions) {
      EXPECT_THAT(uuids, Contains(session.uuid));
      EXPECT_EQ(session.robot, session.uuid == uuids[0] ? "cart-0" : "cart-1");
      EXPECT_EQ(session.frames, frames());
      EXPECT_EQ(session.refused + session.given_up, 0u);
      EXPECT_EQ(session.state, client::SessionState::kEnded);
    }
  };
  const Finished first = run(command(options.data));
  EXPECT_EQ(first.exit_code, 0) << first.standard_error;
  expect_all_there();
  const Finished again = run(command(options.data));
  EXPECT_EQ(again.exit_code, 0) << again.standard_error;
  EXPECT_THAT(again.standard_output, Not(HasSubstr("\"state\":\"done\"")));
  EXPECT_THAT(again.standard_output, HasSubstr("\"state\":\"was there\""));
  expect_all_there();
  // Replaying the log directly adds nothing.
  const Finished replayed = run({built_program("relmap-frontend"), "--source", "log", drives_[0], "--recorded",
                                 uuids[0], "--as-recorded", "--server", options.data, "--spool", "none"});
  EXPECT_EQ(replayed.exit_code, 0) << replayed.standard_error;
  expect_all_there();
}

TEST_F(BatchIngest, TheSameCommandResumesWithAnyOptions) {
  const DaemonOptions options = daemon_options("map", true);
  RunningDaemon daemon(options);
  std::size_t sessions = 0;
  drives_.resize(2);
  const std::vector<std::pair<std::vector<std::string>, int>> interruptions = {
      {{}, SIGTERM},
      {{"--again"}, SIGKILL},
      {{"--robot", "truck", "--again", "--jobs", "1"}, SIGTERM},
      {{"--source", "sim", "--patience", "50", "--despite-check", "--again"}, SIGTERM},
      {{"--deterministic", "--again"}, SIGKILL}};
  for (const auto& [more, signal] : interruptions) {
    const std::string text = ::testing::PrintToString(more);
    // Interrupted once the first of the drives is in, and another is on its way.
    Process batch(command(options.data, more), ProcessOptions{});
    const auto begun = [&] { return daemon.client()->sessions().or_throw().size(); };
    while (batch.running() && begun() < sessions + 2) std::this_thread::sleep_for(milliseconds(2));
    batch.signal(signal);
    ASSERT_TRUE(batch.wait(kPatience)) << text;
    const Finished rest = run(command(options.data, more));
    EXPECT_EQ(rest.exit_code, 0) << text << rest.standard_error;
    sessions += drives_.size();
    const auto all = daemon.client()->sessions().or_throw();
    ASSERT_EQ(all.size(), sessions) << text;
    for (const client::Session& session : all) EXPECT_EQ(session.frames, frames()) << text << session.name;
  }
  // Once it is done it begins anew.
  EXPECT_EQ(run(command(options.data, {"--again"})).exit_code, 0);
  EXPECT_EQ(daemon.client()->sessions()->size(), sessions + drives_.size());
}

TEST_F(BatchIngest, ADaemonThatRestartsAtAnotherPortIsFound) {
  const DaemonOptions options = daemon_options("map", false);
  auto daemon = std::make_unique<RunningDaemon>(options);
  const std::string address = daemon->address();
  // It is stopped while it is examined, so that it still has recordings to begin, however busy the machine is.
  Process batch(command(options.data, {"--jobs", "1"}), ProcessOptions{});
  batch.signal(SIGSTOP);
  while (batch.running() && daemon->client()->sessions().or_throw().empty()) {
    batch.signal(SIGCONT);
    std::this_thread::sleep_for(milliseconds(2));
    batch.signal(SIGSTOP);
  }
  ASSERT_TRUE(batch.running()) << "it was over too soon";
  daemon->process().kill();
  batch.signal(SIGCONT);
  daemon = std::make_unique<RunningDaemon>(options);
  ASSERT_NE(daemon->address(), address);
  EXPECT_EQ(batch.wait(load_.patience), 0) << "all of it was acknowledged";
  const auto sessions = daemon->client()->sessions().or_throw();
  ASSERT_EQ(sessions.size(), 3u);
  for (const client::Session& session : sessions) EXPECT_EQ(session.frames, frames());
}

TEST_F(BatchIngest, InterruptionsDoNotChangeFramesAndTracks) { expect_same_frames(); }

TEST_F(BatchIngest, DeterministicMapsAreIdenticalDespiteInterruptions) { expect_same_map(); }

// A hundred thousand keyframes.
class LongBatchIngest : public BatchIngest {
 protected:
  LongBatchIngest() : BatchIngest({8, 12'500, 2'500, 45, 10, seconds(3000)}) {}
};

TEST_F(LongBatchIngest, InterruptionsDoNotChangeFramesAndTracks) { expect_same_frames(); }

TEST_F(LongBatchIngest, DeterministicMapsAreIdenticalDespiteInterruptions) { expect_same_map(); }

}  // namespace
}  // namespace relmap::testing
