// Callers that take a daemon's connections, calls or memory and give nothing back keep nobody else out.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <atomic>
#include <chrono>
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
  std::vector<std::thread> waits;
  for (int i = 0; i < kWaits; ++i)
    waits.emplace_back([&] {
      const auto client = client::Client::connect(folder_ / "map").or_throw();
      while (!done) {
        most = std::max<int>(most, ++inside);
        refused += client->wait_idle().reason() == Reason::BUDGET_EXCEEDED;
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
  EXPECT_EQ(client_->status().or_throw().storage.reason(), Reason::OK);
  EXPECT_EQ(daemon_->stop(), 0) << daemon_->log();
}

}  // namespace
}  // namespace relmap::testing
