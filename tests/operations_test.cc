// What those who keep relmapd alive see of it: health, metrics, logs, systemd, and settings that change while it runs.
// How soon they see it is measured by `relmap-bench operations`.
#include <gmock/gmock.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <thread>

#include "storage/testing/temporary_folder.h"
#include "tests/file_faults/traced_program.h"
#include "tests/support/http_get.h"
#include "tests/support/running_daemon.h"
#include "tests/support/simulated_recording.h"

namespace relmap::testing {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr std::chrono::hours kForever{1};  // until the disk is mended

bool wait_until(const std::function<bool()>& condition) {
  const auto end = std::chrono::steady_clock::now() + kPatience;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(milliseconds(20));
  }
  return true;
}

// What gRPC's health service says of a service: 1 SERVING, 2 NOT_SERVING, 0 if there is no answer.
int serving(const std::string& address, const std::string& service) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  grpc::GenericStub stub(grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments));
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + seconds(5));
  grpc::CompletionQueue queue;
  std::string request;
  if (!service.empty()) request = "\x0a" + std::string(1, static_cast<char>(service.size())) + service;
  const grpc::Slice slice(request);
  const auto call =
      stub.PrepareUnaryCall(&context, "/grpc.health.v1.Health/Check", grpc::ByteBuffer(&slice, 1), &queue);
  grpc::ByteBuffer reply;
  grpc::Status status;
  call->StartCall();
  call->Finish(&reply, &status, nullptr);
  void* tag = nullptr;
  bool ok = false;
  queue.Next(&tag, &ok);
  std::vector<grpc::Slice> slices;
  if (!status.ok() || !reply.Dump(&slices).ok() || slices.empty() || slices[0].size() < 2) return 0;
  return slices[0].begin()[1];
}

class Operations : public ::testing::Test {
 protected:
  DaemonOptions options() const {
    return {.data = folder_ / "disk/map",
            .lcm = "",
            .more = {"--http", "0", "--config", folder_ / "relmapd.yaml"},
            .environment = faults_.environment()};
  }
  void configure(const std::string& text) const {
    std::ofstream(folder_ / "new.yaml") << text;
    fs::rename(folder_ / "new.yaml", folder_ / "relmapd.yaml");
  }
  Operations() { configure(""); }

  static std::string page(const RunningDaemon& daemon, const std::string& path) {
    return http_get(daemon.http(), path).body;
  }
  static double sample(const RunningDaemon& daemon, const std::string& name) {
    const auto samples = samples_of(page(daemon, "/metrics"));
    const auto found = samples.find(name);
    return found == samples.end() ? -1 : found->second;
  }
  // Sends a drive of a few keyframes in the background; waits for it at the end.
  std::unique_ptr<Process> robot(const RunningDaemon& daemon, const std::string& name,
                                 const std::string& rate = "max") {
    if (!fs::exists(folder_ / "drive"))
      record_simulation(folder_ / "drive", {"--seed", "1", "--pairs", "20", "--laps", "0.1"});
    return std::make_unique<Process>(
        std::vector<std::string>{built_program("relmap-frontend"), folder_ / "drive", "--robot", name, "--session",
                                 name, "--server", daemon.address(), "--spool", "none", "--quiet", "--rate", rate},
        ProcessOptions{});
  }
  // The same, a keyframe or two a second, once the first of them are in the map.
  std::unique_ptr<Process> slow_robot(const RunningDaemon& daemon, const std::string& name) {
    const double before = sample(daemon, "relmap_frames");
    auto sending = robot(daemon, name, "2");
    EXPECT_TRUE(wait_until([&] { return sample(daemon, "relmap_frames") > before + 1; })) << daemon.log();
    return sending;
  }
  static std::string made(const std::string& path) {
    fs::create_directories(path);
    return path;
  }

  const storage::TemporaryFolder folder_;
  FileFaults faults_{made(folder_ / "disk"), folder_ / "notes", Recording::kOff};
};

TEST_F(Operations, ADaemonInGoodHealthSaysSoEverywhere) {
  RunningDaemon daemon(options());
  const auto sent = robot(daemon, "cart");
  ASSERT_EQ(sent->wait(kPatience), 0);
  EXPECT_EQ(page(daemon, "/readyz"), "ok\nstorage: ok\nworker: ok\nintake: ok\n");
  EXPECT_EQ(http_get(daemon.http(), "/livez").status, 200);
  for (const char* service : {"", "relmap.v1.Map", "relmap.v1.Ingest", "relmap.v1.Admin"})
    EXPECT_EQ(serving(daemon.address(), service), 1) << service;
  const auto status = daemon.client()->status().or_throw();
  const auto samples = samples_of(page(daemon, "/metrics"));
  EXPECT_EQ(samples.at("relmap_frames"), static_cast<double>(status.frames));
  EXPECT_GE(samples.at("relmap_keyframes_durable_total"), static_cast<double>(status.frames));
  EXPECT_EQ(samples.at("relmap_ready"), 1);
  EXPECT_GT(samples.at("process_cpu_seconds_total"), 0);
  EXPECT_EQ(samples.at("relmap_rpc_seconds_count{method=\"Ingest.Stream\",reason=\"OK\"}"), 1);
  for (const auto& [name, state] : status.components) EXPECT_TRUE(state.ok()) << name << state.to_string();
  EXPECT_EQ(status.components.size(), 3u);
}

// An fsync that does not return: a disk that hangs. The daemon says so in every way that it has, and that it is not
// alive once that has lasted; it goes on when the disk does.
TEST_F(Operations, ADiskThatHangsShowsAndPasses) {
  configure("hung_after_s: 5\n");
  RunningDaemon daemon(options());
  const auto first = robot(daemon, "cart");
  ASSERT_EQ(first->wait(kPatience), 0);
  const auto second = slow_robot(daemon, "dolly");
  faults_.fail_from_now_on(FaultKind::kSync, 0, kForever);
  EXPECT_TRUE(wait_until([&] { return page(daemon, "/readyz").find("storage: STALLED: ") != std::string::npos; }))
      << page(daemon, "/readyz");
  EXPECT_EQ(http_get(daemon.http(), "/readyz").status, 503);
  // An append to the journal or a commit, whichever came first.
  EXPECT_GT(std::max(sample(daemon, "relmap_busy_seconds{thread=\"journal\"}"),
                     sample(daemon, "relmap_busy_seconds{thread=\"commit\"}")),
            3);
  EXPECT_EQ(sample(daemon, "relmap_component_problem{component=\"storage\",reason=\"STALLED\"}"), 1);
  EXPECT_TRUE(wait_until([&] { return serving(daemon.address(), "relmap.v1.Ingest") == 2; }));
  EXPECT_EQ(serving(daemon.address(), "relmap.v1.Map"), 1) << "questions are answered";
  const auto status = daemon.client()->status().or_throw();
  EXPECT_EQ(status.components.at(0).second.reason(), Reason::STALLED);
  EXPECT_TRUE(wait_until([&] { return http_get(daemon.http(), "/livez").status == 503; })) << "after hung_after_s";
  EXPECT_TRUE(wait_until([&] { return serving(daemon.address(), "") == 2; }));
  EXPECT_TRUE(faults_.hanging());
  faults_.mend();
  EXPECT_TRUE(wait_until([&] { return http_get(daemon.http(), "/readyz").status == 200; }));
  EXPECT_EQ(sample(daemon, "relmap_component_problem{component=\"storage\",reason=\"STALLED\"}"), -1);
  EXPECT_EQ(second->wait(kPatience), 0);
  EXPECT_EQ(daemon.stop(), 0);
}

TEST_F(Operations, ADiskThatFailsOrIsFullShowsAndPasses) {
  RunningDaemon daemon(options());
  for (const auto& [error, reason] : {std::pair(EIO, "IO_ERROR"), std::pair(ENOSPC, "DISK_FULL")}) {
    faults_.fail_from_now_on(FaultKind::kWrite, error);
    const auto sent = robot(daemon, reason);
    const std::string problem =
        "relmap_component_problem{component=\"storage\",reason=\"" + std::string(reason) + "\"}";
    EXPECT_TRUE(wait_until([&] { return sample(daemon, problem) == 1; })) << reason << page(daemon, "/readyz");
    EXPECT_THAT(page(daemon, "/readyz"), HasSubstr("storage: " + std::string(reason)));
    EXPECT_EQ(http_get(daemon.http(), "/livez").status, 200) << "a new start would not help";
    EXPECT_GT(sample(daemon, "relmap_log_lines_total{level=\"error\"}"), 0);
    faults_.mend();
    EXPECT_TRUE(wait_until([&] { return http_get(daemon.http(), "/readyz").status == 200; }));
    EXPECT_EQ(sent->wait(kPatience), 0);
  }
}

TEST_F(Operations, AClockThatIsSetShows) {
  RunningDaemon daemon(options());
  EXPECT_EQ(sample(daemon, "relmap_clock_steps_total"), 0);
  faults_.set_clock(-3600);
  EXPECT_TRUE(wait_until([&] { return sample(daemon, "relmap_clock_steps_total") == 1; }));
  EXPECT_NEAR(sample(daemon, "relmap_clock_step_seconds"), -3600, 1);
  EXPECT_THAT(page(daemon, "/readyz"), HasSubstr("clock: set back by 3600.0 s"));
  EXPECT_THAT(daemon.log(), HasSubstr("the system's clock was set back by 3600.0 s"));
  const Finished status = run_program({built_program("relmap"), "--server", folder_ / "disk/map", "status"});
  EXPECT_THAT(status.standard_output, HasSubstr("clock"));
}

// systemd's end of the notify protocol.
class Manager {
 public:
  explicit Manager(std::string path)
      : path_(std::move(path)), socket_(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path_.c_str(), sizeof address.sun_path - 1);
    EXPECT_EQ(bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  }
  ~Manager() { close(socket_); }
  std::vector<std::string> environment() const { return {"NOTIFY_SOCKET=" + path_, "WATCHDOG_USEC=15000000"}; }
  // Whether a message with this comes; messages before it are skipped.
  bool hears(const std::string& what, milliseconds patience = kPatience) {
    const auto end = std::chrono::steady_clock::now() + patience;
    for (;;) {
      const auto left = std::chrono::duration_cast<milliseconds>(end - std::chrono::steady_clock::now());
      pollfd one{socket_, POLLIN, 0};
      if (left.count() <= 0 || poll(&one, 1, static_cast<int>(left.count())) <= 0) return false;
      char text[4096];
      const ssize_t size = recv(socket_, text, sizeof text, 0);
      if (size > 0 && std::string(text, static_cast<std::size_t>(size)).find(what) != std::string::npos) return true;
    }
  }
  void forget() {
    while (hears("", milliseconds(1))) {
    }
  }

 private:
  const std::string path_;
  const int socket_;
};

TEST_F(Operations, SystemdHearsHowTheDaemonIs) {
  configure("hung_after_s: 2\n");
  Manager manager(folder_ / "notify");
  DaemonOptions watched = options();
  for (const std::string& variable : manager.environment()) watched.environment.push_back(variable);
  RunningDaemon daemon(watched);
  EXPECT_TRUE(manager.hears("READY=1"));
  EXPECT_TRUE(manager.hears("WATCHDOG=1"));
  EXPECT_TRUE(manager.hears("STATUS=0 keyframes of 0 sessions; ok"));
  daemon.process().signal(SIGHUP);
  EXPECT_TRUE(manager.hears("RELOADING=1"));
  EXPECT_TRUE(manager.hears("READY=1"));
  // The journal hangs: the watchdog is not fed any more, so systemd would start the daemon again.
  const auto sent = slow_robot(daemon, "cart");
  faults_.fail_from_now_on(FaultKind::kSync, 0, kForever);
  EXPECT_TRUE(manager.hears("storage: STALLED"));
  EXPECT_TRUE(wait_until([&] { return http_get(daemon.http(), "/livez").status == 503; }));
  manager.forget();
  EXPECT_FALSE(manager.hears("WATCHDOG=1", seconds(3))) << "a daemon that hangs must not look alive";
  faults_.mend();
  EXPECT_TRUE(manager.hears("WATCHDOG=1"));
  EXPECT_EQ(sent->wait(kPatience), 0);
  daemon.process().signal(SIGTERM);
  EXPECT_TRUE(manager.hears("STOPPING=1"));
  EXPECT_EQ(daemon.process().wait(kPatience), 0);
}

TEST_F(Operations, SettingsChangeWhileTheDaemonRunsOrAreRefusedByName) {
  configure("log_level: info\nmemory_budget_mb: 256\n");
  RunningDaemon daemon(options());
  configure("log_level: debug\ningest: { robots: [nobody] }\nrpc: { threads: 3 }\nrba: { window: 9 }\n");
  daemon.process().signal(SIGHUP);
  EXPECT_TRUE(wait_until([&] { return daemon.log().find("NEEDS_RESTART: rba.window") != std::string::npos; }));
  EXPECT_THAT(daemon.log(), HasSubstr("SIGHUP: NEEDS_RESTART: rpc.threads stays 4 until the daemon is started again; "
                                      "3 was read"));
  EXPECT_THAT(daemon.log(), HasSubstr("NEEDS_RESTART: rba.window stays 8"));
  EXPECT_TRUE(daemon.client()->status().ok());
  EXPECT_TRUE(wait_until([&] { return daemon.log().find("[debug]") != std::string::npos; }));
  const auto sent = robot(daemon, "cart");
  EXPECT_TRUE(wait_until([&] { return sample(daemon, "relmap_keyframes_refused_total{reason=\"NOT_ALLOWED\"}") > 0; }))
      << "only the robot nobody may send now";
  sent->kill();
  configure("log_level: nonsense\n");
  daemon.process().signal(SIGHUP);
  EXPECT_TRUE(wait_until(
      [&] { return daemon.log().find("SIGHUP: the settings stay as they were: BAD_CONFIG") != std::string::npos; }));
  EXPECT_EQ(daemon.client()->status().or_throw().log_level, "debug");
  EXPECT_EQ(daemon.stop(), 0);
}

TEST_F(Operations, TheLogLevelChangesOnDemand) {
  RunningDaemon daemon(options());
  const auto admin = [&](std::vector<std::string> more) {
    std::vector<std::string> arguments{built_program("relmap-admin")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_program(arguments);
  };
  EXPECT_EQ(admin({"log-level", folder_ / "disk/map"}).standard_output, "info\n");
  EXPECT_EQ(admin({"log-level", folder_ / "disk/map", "debug"}).standard_output,
            "the log level is debug now, and was info\n");
  EXPECT_EQ(admin({"--json", "--server", daemon.address(), "log-level"}).standard_output,
            "{\"level\":\"debug\",\"former\":\"debug\",\"reason\":\"OK\",\"message\":\"\"}\n");
  const Finished loud = admin({"--server", daemon.address(), "log-level", "loud"});
  EXPECT_EQ(loud.exit_code, 1);
  EXPECT_THAT(loud.standard_error, HasSubstr("INVALID_ARGUMENT: there is no log level 'loud'"));
  EXPECT_EQ(admin({"log-level"}).exit_code, 2);
  EXPECT_THAT(daemon.log(), HasSubstr("[debug]"));
  EXPECT_EQ(daemon.client()->status().or_throw().log_level, "debug");
}

TEST_F(Operations, ARequestIsFoundInTheLogByItsName) {
  DaemonOptions json = options();
  json.more.insert(json.more.end(), {"--log-format", "json", "--log-level", "debug"});
  RunningDaemon daemon(json);
  const std::string trace = "4bf92f3577b34da6a3ce929d0e0e4736";
  const Finished asked =
      run_program({built_program("relmap"), "--server", daemon.address(), "frame", "9:9"}, kPatience,
                  {"RELMAP_REQUEST_ID=night-shift-7", "TRACEPARENT=00-" + trace + "-00f067aa0ba902b7-01"});
  EXPECT_EQ(asked.exit_code, 1);
  std::istringstream lines(daemon.log());
  int found = 0;
  for (std::string line; std::getline(lines, line);) {
    const auto event = nlohmann::json::parse(line);
    if (event.value("request_id", "") != "night-shift-7") continue;
    EXPECT_EQ(event.at("trace_id"), trace);
    EXPECT_EQ(event.at("level"), "debug");
    found += event.at("message").get<std::string>().find("Map.GetFrame") == 0;
  }
  EXPECT_EQ(found, 1) << daemon.log();
  const Finished odd = run_program({built_program("relmap"), "--server", daemon.address(), "frame", "9:9"}, kPatience,
                                   {"RELMAP_REQUEST_ID=two\nlines"});
  EXPECT_EQ(odd.exit_code, 2) << odd.standard_error;
}

// As the package sets it up: the socket in a folder of its own, which a group may use, and the map in another.
TEST_F(Operations, TheSocketMayLieOutsideOfTheMap) {
  fs::create_directories(folder_ / "run");
  configure("socket: " + folder_ / "run/socket" + "\n");
  {
    RunningDaemon daemon(options());
    EXPECT_TRUE(fs::is_socket(folder_ / "run/socket"));
    EXPECT_FALSE(fs::exists(folder_ / "disk/map/socket"));
    for (const std::string& where : {folder_ / "run", folder_ / "disk/map"}) {
      const Finished status = run_program({built_program("relmap"), "--server", where, "status"});
      EXPECT_EQ(status.exit_code, 0) << where << status.standard_error;
    }
    EXPECT_EQ(read_text(folder_ / "run/endpoint"), read_text(folder_ / "disk/map/endpoint"));
    EXPECT_EQ(daemon.stop(), 0);
  }
  EXPECT_TRUE(fs::is_empty(folder_ / "run"));
}

// What a load balancer sees of a stop: not ready before anybody is turned away.
TEST_F(Operations, ADaemonThatStopsSaysSoFirst) {
  RunningDaemon daemon(options());
  const auto sent = slow_robot(daemon, "cart");
  faults_.fail_from_now_on(FaultKind::kSync, 0, kForever);
  EXPECT_TRUE(wait_until([&] { return faults_.hanging(); }));
  const std::string http = daemon.http();
  daemon.process().signal(SIGTERM);
  EXPECT_TRUE(wait_until([&] {
    return http_get(http, "/readyz").body.find("intake: SHUTTING_DOWN") != std::string::npos;
  })) << "while it waits for the disk";
  faults_.mend();
  EXPECT_EQ(daemon.process().wait(kPatience), 0);
  EXPECT_EQ(http_get(http, "/readyz").status, 0);
  sent->kill();
}

}  // namespace
}  // namespace relmap::testing
