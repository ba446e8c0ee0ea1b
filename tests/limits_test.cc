// Callers that take a daemon's connections, calls or memory and give nothing back keep nobody else out.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

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
  std::vector<RawHttp2> connect(std::size_t count, std::uint32_t window) const {
    std::vector<RawHttp2> all;
    for (std::size_t i = 0; i < count; ++i) {
      RawHttp2 one(daemon_->address());
      if (one.connected()) one.begin(window);
      all.push_back(std::move(one));
    }
    return all;
  }
  void expect_answers(int times) const {
    for (int i = 0; i < times; ++i) {
      const auto status = client_->status();
      ASSERT_TRUE(status.ok()) << status.status().to_string();
    }
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
  expect_answers(20);
  const auto same_address = client::Client::connect(daemon_->address());
  ASSERT_TRUE(eventually([&] { return (*same_address)->sessions().reason() == Reason::BUDGET_EXCEEDED; }));
  EXPECT_THAT((*same_address)->sessions().status().message(), HasSubstr("10 calls of ipv4:127.0.0.1 are running"));
  expect_answers(5);
  stalled.clear();
  EXPECT_TRUE(eventually([&] { return (*same_address)->sessions().ok(); }));
  EXPECT_EQ(daemon_->stop(), 0) << daemon_->log();
}

TEST_F(LimitsTest, RequestsThatNeverArriveAndIdleConnectionsKeepNobodyOut) {
  serve("");
  auto halves = connect(100, 65535);
  for (RawHttp2& one : halves) one.call(kStatus, std::string(20, 'x'), 10);
  const auto idle = connect(400, 65535);
  expect_answers(20);
  EXPECT_TRUE(eventually([&] { return daemon_->log().find("make room for others") != std::string::npos; }));
  EXPECT_EQ(daemon_->stop(), 0) << daemon_->log();
}

// A connection is kept for a call that runs over it, and not for a request that is half sent.
TEST_F(LimitsTest, ConnectionsOverWhichNobodyCallsAreClosed) {
  serve("rpc: {quiet_s: 2, stalled_s: 600}\n");
  drive();
  auto halves = connect(5, 65535);
  for (RawHttp2& one : halves) one.call(kStatus, std::string(20, 'x'), 10);
  auto running = connect(1, 0);
  running.front().call(kExport, kGraph);
  for (RawHttp2& one : halves) EXPECT_TRUE(eventually([&] { return one.ended(); }));
  EXPECT_FALSE(running.front().ended());
  expect_answers(1);
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
