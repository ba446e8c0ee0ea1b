// Callers that take a daemon's connections, calls or memory and give nothing back keep nobody else out.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <thread>
#include <vector>

#include "storage/testing/temporary_folder.h"
#include "tests/support/process.h"
#include "tests/support/raw_http2.h"
#include "tests/support/running_daemon.h"
#include "tests/support/simulated_recording.h"

namespace relmap::testing {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;
using ::testing::HasSubstr;

constexpr char kStatus[] = "/relmap.v1.Map/GetStatus", kExport[] = "/relmap.v1.Map/Export";
const std::string kGraph("\x08\x01", 2);  // ExportRequest{format: 1}

class LimitsTest : public ::testing::Test {
 protected:
  // A daemon over TCP without TLS, and at its socket, by which the others come.
  void serve(const std::string& settings) {
    std::ofstream(folder_ / "relmapd.yaml") << settings;
    DaemonOptions options{.data = folder_ / "map", .lcm = "", .more = {"--config", folder_ / "relmapd.yaml"}};
    options.program = program_;
    daemon_ = std::make_unique<RunningDaemon>(options);
    client_ = client::Client::connect(folder_ / "map").or_throw();
  }
  void drive() const {
    record_simulation(folder_ / "drive", {"--seed", "1", "--pairs", "12", "--laps", "0.1"});
    const Finished streamed = run_program({built_program("relmap-frontend"), folder_ / "drive", "--robot", "cart",
                                           "--server", folder_ / "map", "--spool", "none", "--quiet"});
    ASSERT_EQ(streamed.exit_code, 0) << streamed.standard_error;
    ASSERT_TRUE(client_->wait_idle().ok());
  }
  // From the address at which our own client over TCP stands, unless from another one.
  std::vector<RawHttp2> connect(std::size_t count, std::uint32_t window, const std::string& from = "") const {
    std::vector<RawHttp2> all;
    for (std::size_t i = 0; i < count; ++i) {
      RawHttp2 one(daemon_->address(), from);
      if (one.connected()) one.begin(window);
      all.push_back(std::move(one));
    }
    return all;
  }
  void expect_answers(int times) const { expect_answers(*client_, times); }
  static void expect_answers(client::Client& client, int times) {
    for (int i = 0; i < times; ++i) {
      const auto status = client.status();
      ASSERT_TRUE(status.ok()) << status.status().to_string();
    }
  }
  static std::ptrdiff_t running(std::vector<RawHttp2>& calls) {
    return std::count_if(calls.begin(), calls.end(), [](RawHttp2& one) { return !one.ended(); });
  }
  static std::ptrdiff_t open(std::vector<RawHttp2>& connections) {
    return std::count_if(connections.begin(), connections.end(), [](RawHttp2& one) { return !one.closed(); });
  }
  template <typename Condition>
  static bool eventually(Condition condition) {
    const auto until = steady_clock::now() + kPatience;
    while (!condition() && steady_clock::now() < until) std::this_thread::sleep_for(milliseconds(20));
    return condition();
  }

  const storage::TemporaryFolder folder_;
  std::string program_;
  std::unique_ptr<RunningDaemon> daemon_;
  std::unique_ptr<client::Client> client_;
};

TEST_F(LimitsTest, WhoTakesNoAnswerIsCutOffAndKeepsNobodyOut) {
  serve("rpc: {stalled_s: 2}\n");
  drive();
  for (const char* path : {kStatus, kExport}) {
    auto stalled = connect(64, 0);
    for (RawHttp2& one : stalled) one.call(path, path == std::string(kExport) ? kGraph : "");
    expect_answers(20);
    EXPECT_TRUE(client_->sessions().ok());
    for (RawHttp2& one : stalled) EXPECT_TRUE(eventually([&] { return one.ended(); })) << path;
    expect_answers(1);
  }
  EXPECT_THAT(daemon_->log(), HasSubstr("it has taken no message for 2 s"));
  EXPECT_EQ(daemon_->stop(), 0) << daemon_->log();
}

TEST_F(LimitsTest, OneCallersCallsLeaveRoomForOthers) {
  serve("rpc: {stalled_s: 600, max_concurrent: 20, max_concurrent_per_caller: 10}\n");
  drive();
  auto stalled = connect(100, 0);
  for (RawHttp2& one : stalled) one.call(kExport, kGraph);
  EXPECT_TRUE(eventually([&] { return running(stalled) == 10; })) << running(stalled) << " calls are running";
  expect_answers(20);
  const auto same_address = client::Client::connect(daemon_->address());
  ASSERT_TRUE(eventually([&] { return (*same_address)->sessions().reason() == Reason::BUDGET_EXCEEDED; }));
  EXPECT_THAT((*same_address)->sessions().status().message(), HasSubstr("10 calls of ipv4:127.0.0.1 are running"));
  expect_answers(5);
  EXPECT_EQ(running(stalled), 10) << "the answers came since the others had gone";
  stalled.clear();
  EXPECT_TRUE(eventually([&] { return (*same_address)->sessions().ok(); }));
  EXPECT_EQ(daemon_->stop(), 0) << daemon_->log();
}

TEST_F(LimitsTest, RequestsThatNeverArriveAndIdleConnectionsKeepNobodyOut) {
  serve("rpc: {max_connections: 400, max_connections_per_peer: 200}\n");
  auto halves = connect(100, 65535, "127.0.0.2");
  for (RawHttp2& one : halves) one.call(kStatus, std::string(20, 'x'), 10);
  auto idle = connect(400, 65535, "127.0.0.3");
  const auto over_tcp = client::Client::connect(daemon_->address()).or_throw();
  expect_answers(*over_tcp, 20);
  expect_answers(20);
  EXPECT_EQ(running(halves), 100) << "the answers came since the others had gone";
  EXPECT_TRUE(eventually([&] { return open(idle) == 200; })) << open(idle) << " are open";
  // Who comes later is answered as well, and where an address has as many as it may have, the oldest makes room.
  EXPECT_TRUE(client::Client::connect(daemon_->address()).or_throw()->status().ok());
  auto more = connect(1, 65535, "127.0.0.3");
  EXPECT_TRUE(eventually([&] { return open(idle) == 199; })) << open(idle) << " are open";
  EXPECT_FALSE(more[0].closed());
  EXPECT_EQ(running(halves), 100) << "those of another address";
  EXPECT_THAT(daemon_->log(), HasSubstr("make room for others"));
  EXPECT_EQ(daemon_->stop(), 0) << daemon_->log();
}

// A connection is kept for a call that runs over it, and not for a request that is half sent.
TEST_F(LimitsTest, ConnectionsOverWhichNobodyCallsAreClosed) {
  serve("rpc: {quiet_s: 2, stalled_s: 600}\n");
  drive();
  auto halves = connect(5, 65535);
  for (RawHttp2& one : halves) one.call(kStatus, std::string(20, 'x'), 10);
  auto called = connect(1, 0);
  called.front().call(kExport, kGraph);
  for (RawHttp2& one : halves) EXPECT_TRUE(eventually([&] { return one.ended(); }));
  EXPECT_FALSE(called.front().ended());
  expect_answers(1);
  EXPECT_EQ(daemon_->stop(), 0) << daemon_->log();
}

// More calls of WaitIdle than there are threads, and than may run at once otherwise, while keyframes come in.
TEST_F(LimitsTest, WhoWaitsUntilAllIsDoneHoldsUpNeitherQuestionsNorEdits) {
  serve("rpc: {threads: 2, max_concurrent: 4}\n");
  drive();
  record_simulation(folder_ / "long", {"--seed", "2", "--pairs", "100", "--laps", "0.5"});
  Process robot({built_program("relmap-frontend"), folder_ / "long", "--robot", "barrow", "--server", folder_ / "map",
                 "--spool", "none", "--quiet"},
                {});
  constexpr int kWaits = 16;
  std::atomic<bool> done = false;
  std::atomic<int> inside = 0, most = 0, refused = 0;
  std::vector<std::unique_ptr<client::Client>> clients;  // who connects asks something that counts among the four calls
  for (int i = 0; i < kWaits; ++i) clients.push_back(client::Client::connect(folder_ / "map").or_throw());
  std::vector<std::thread> waits;
  for (const auto& client : clients)
    waits.emplace_back([&, waiting = client.get()] {
      while (!done) {
        most = std::max<int>(most, ++inside);
        refused += waiting->wait_idle().reason() == Reason::BUDGET_EXCEEDED;
        --inside;
      }
    });
  EXPECT_TRUE(eventually([&] { return most == kWaits; })) << most << " wait at once";
  for (int i = 0; i < 20; ++i) {
    expect_answers(5);
    const auto labels = client_->set_label({1, 0}, "label " + std::to_string(i));
    EXPECT_TRUE(labels.ok()) << labels.status().to_string();
    EXPECT_TRUE(client_->sessions().ok());
  }
  done = true;
  for (std::thread& wait : waits) wait.join();
  EXPECT_EQ(refused, 0) << "they have a limit of their own";
  EXPECT_EQ(robot.wait(kPatience), 0);
  EXPECT_EQ(daemon_->stop(), 0) << daemon_->log();
}

// A shell allows 1,024 files or fewer unless it is asked; the daemon takes as many as it may.
TEST_F(LimitsTest, TheDaemonTakesAllTheFilesThatItMay) {
  program_ = folder_ / "soft-limit";
  std::ofstream(program_) << "#!/bin/sh\nulimit -Sn 256\nexec " << built_program("relmapd") << " \"$@\"\n";
  ASSERT_EQ(chmod(program_.c_str(), 0700), 0);
  serve("");
  rlimit files{}, ours{};
  ASSERT_EQ(prlimit(daemon_->process().pid(), RLIMIT_NOFILE, nullptr, &files), 0);
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &ours), 0);
  EXPECT_EQ(files.rlim_cur, ours.rlim_max);
  auto some = connect(400, 65535);
  EXPECT_TRUE(client_->status().or_throw().connections.ok());
  EXPECT_EQ(open(some), 400);
  EXPECT_EQ(daemon_->stop(), 0) << daemon_->log();
}

// With few files allowed, connections leave the map those that it needs.
TEST_F(LimitsTest, ConnectionsLeaveTheMapItsFiles) {
  program_ = folder_ / "few-files";
  std::ofstream(program_) << "#!/bin/sh\nulimit -n 160\nexec " << built_program("relmapd") << " \"$@\"\n";
  ASSERT_EQ(chmod(program_.c_str(), 0700), 0);
  serve("");
  EXPECT_THAT(daemon_->log(), HasSubstr("TOO_MANY_FILES: 160 files may be open"));
  const auto idle = connect(300, 65535);
  drive();
  expect_answers(5);
  const auto status = client_->status().or_throw();
  EXPECT_TRUE(status.storage.ok()) << status.storage.to_string();
  EXPECT_EQ(status.connections.reason(), Reason::TOO_MANY_FILES);
  EXPECT_THAT(status.connections.message(), HasSubstr("160 files may be open"));
  EXPECT_GT(status.connections_displaced + status.connections_refused, 200u) << "of 300, " << status.connections_open;
  EXPECT_EQ(daemon_->stop(), 0) << daemon_->log();
}

// A process that has run out of files refuses connections at once, says so, and takes them again when it has some.
TEST_F(LimitsTest, WithoutAFileForAConnectionTheDaemonSaysSoAndGoesOn) {
  serve("");
  drive();
  EXPECT_TRUE(client_->status().or_throw().connections.ok());
  const pid_t pid = daemon_->process().pid();
  rlim_t files = 0;  // as many as reach to the last that is open
  for (const auto& file : std::filesystem::directory_iterator("/proc/" + std::to_string(pid) + "/fd"))
    files = std::max<rlim_t>(files, std::stoul(file.path().filename()) + 1);
  rlimit before{};
  ASSERT_EQ(prlimit(pid, RLIMIT_NOFILE, nullptr, &before), 0);
  const rlimit full{files, before.rlim_max};
  ASSERT_EQ(prlimit(pid, RLIMIT_NOFILE, &full, nullptr), 0);
  {
    auto some = connect(200, 65535), more = connect(200, 65535, "127.0.0.2");  // the first find numbers that are free
    EXPECT_TRUE(eventually([&] { return open(more) < 190; }));
    const auto status = client_->status();
    ASSERT_TRUE(status.ok()) << "over the connection that it has: " << status.status().to_string();
    EXPECT_EQ(status->connections.reason(), Reason::TOO_MANY_FILES) << status->connections.to_string();
  }
  ASSERT_EQ(prlimit(pid, RLIMIT_NOFILE, &before, nullptr), 0);
  auto taken = connect(30, 65535);
  expect_answers(5);
  EXPECT_EQ(open(taken), 30);
  EXPECT_EQ(daemon_->stop(), 0) << daemon_->log();
}

class LongLimits : public LimitsTest {};

TEST_F(LongLimits, ThousandsAtOnceKeepNobodyOut) {
  rlimit files{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &files), 0);
  files.rlim_cur = files.rlim_max;
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &files), 0);
  ASSERT_GT(files.rlim_cur, 8000u) << "this test needs a higher hard limit of files";
  std::filesystem::create_directory(folder_ / "backups");
  serve("rpc: {max_connections: 7000, max_connections_per_peer: 7000}\nbackup: {roots: [" + (folder_ / "backups") +
        "]}\n");
  drive();
  auto idle = connect(5000, 65535, "127.0.0.3"), halves = connect(100, 65535, "127.0.0.2");
  for (RawHttp2& one : halves) one.call(kStatus, std::string(20, 'x'), 10);
  auto stalled = connect(1000, 0);
  for (RawHttp2& one : stalled) one.call(kExport, kGraph);
  record_simulation(folder_ / "long", {"--seed", "2", "--pairs", "200", "--laps", "1"});
  Process robot({built_program("relmap-frontend"), folder_ / "long", "--robot", "barrow", "--server", folder_ / "map",
                 "--spool", "none", "--quiet"},
                {});
  std::vector<std::unique_ptr<client::Client>> clients;
  for (int i = 0; i < 16; ++i) clients.push_back(client::Client::connect(folder_ / "map").or_throw());
  std::atomic<bool> done = false;
  std::vector<std::thread> waits;
  for (const auto& client : clients)
    waits.emplace_back([&done, waiting = client.get()] {
      while (!done) (void)waiting->wait_idle();
    });
  expect_answers(500);
  EXPECT_GT(running(stalled), 0);
  const auto backup = client_->backup(folder_ / "backups/one", [](const auto&) { return true; });
  EXPECT_TRUE(backup.ok()) << backup.status().to_string();
  expect_answers(500);
  EXPECT_EQ(open(idle), 5000);
  EXPECT_EQ(running(halves), 100);
  EXPECT_EQ(open(stalled), 1000);
  done = true;
  for (std::thread& wait : waits) wait.join();
  EXPECT_EQ(robot.wait(kPatience), 0);
  EXPECT_EQ(daemon_->stop(), 0) << daemon_->log();
}

}  // namespace
}  // namespace relmap::testing
