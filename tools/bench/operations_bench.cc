// What operators get and what it costs: how soon a fault shows in health and metrics, what scrapes cost beside a fleet,
// and how long the daemon takes to stop with it.
#include <cerrno>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <functional>
#include <iostream>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "proto/base/quantile.h"
#include "storage/testing/temporary_folder.h"
#include "tests/file_faults/traced_program.h"
#include "tests/support/http_get.h"
#include "tests/support/running_daemon.h"
#include "tools/bench/stopwatch.h"
#include "tools/bench/streaming_robots.h"
#include "tools/bench/subcommand.h"

namespace relmap::bench {

namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::FaultKind;
using testing::http_get;
using testing::RunningDaemon;

constexpr double kRobotRate_hz = 2;  // keyframes a second of each robot
constexpr double kScrapeInterval_s = 15;
constexpr seconds kHang{120};

struct OperationsOptions {
  std::uint32_t robots = 20;
  double seconds = 20;  // of each measurement of cost
};

// A daemon with an HTTP port on a disk that can be made to fail, and robots that send to it.
class WatchedDaemon {
 public:
  WatchedDaemon(const std::string& folder, std::uint32_t robots)
      : faults_(made(folder + "/disk"), folder + "/notes", testing::Recording::kOff) {
    daemon_ = std::make_unique<RunningDaemon>(testing::DaemonOptions{.data = folder + "/disk/map",
                                                                     .lcm = "",
                                                                     .memory_budget_mb = 1024,
                                                                     .more = {"--http", "0"},
                                                                     .environment = faults_.environment()});
    http_ = daemon_->http();
    robots_.emplace(folder, folder + "/disk/map", robots, kRobotRate_hz);
    const auto begin = Clock::now();
    while (sample("relmap_robots") < robots || sample("relmap_frames") < 2 * robots) {
      if (seconds_since(begin) > 120) throw std::runtime_error("the robots do not send: " + daemon_->log());
      std::this_thread::sleep_for(milliseconds(50));
    }
  }

  RunningDaemon& daemon() { return *daemon_; }
  testing::FileFaults& faults() { return faults_; }
  testing::HttpAnswer page(const std::string& path) const { return http_get(http_, path); }
  double sample(const std::string& name) const {
    const auto samples = testing::samples_of(page("/metrics").body);
    const auto found = samples.find(name);
    return found == samples.end() ? -1 : found->second;
  }

 private:
  static std::string made(const std::string& path) {
    fs::create_directories(path);
    return path;
  }
  testing::FileFaults faults_;
  std::unique_ptr<RunningDaemon> daemon_;
  std::string http_;
  std::optional<StreamingRobots> robots_;
};

// Seconds until it holds; throws after a minute.
double until(const std::string& what, const std::function<bool()>& shows) {
  const auto begin = Clock::now();
  while (!shows()) {
    if (seconds_since(begin) > 60) throw std::runtime_error("it does not show: " + what);
    std::this_thread::sleep_for(milliseconds(20));
  }
  return seconds_since(begin);
}

void faults(const std::string& folder, Report& report) {
  struct Fault {
    const char *name, *meaning;
    std::function<void(WatchedDaemon&)> happens;
    std::string health, metric;
  };
  const auto problem = [](const std::string& reason) {
    return "relmap_component_problem{component=\"storage\",reason=\"" + reason + "\"}";
  };
  const std::vector<Fault> all{
      {"hang", "an fsync that does not return",
       [](WatchedDaemon& d) { d.faults().fail_from_now_on(FaultKind::kSync, 0, kHang); }, "storage: STALLED",
       problem("STALLED")},
      {"full", "a disk that is full", [](WatchedDaemon& d) { d.faults().fail_from_now_on(FaultKind::kWrite, ENOSPC); },
       "storage: DISK_FULL", problem("DISK_FULL")},
      {"failing", "a disk that fails", [](WatchedDaemon& d) { d.faults().fail_from_now_on(FaultKind::kWrite, EIO); },
       "storage: IO_ERROR", problem("IO_ERROR")},
  };
  for (const Fault& fault : all) {
    WatchedDaemon watched(folder + "/" + fault.name, 1);
    const auto begin = Clock::now();
    fault.happens(watched);
    until(fault.name, [&] { return watched.page("/readyz").body.find(fault.health) != std::string::npos; });
    const double health_s = seconds_since(begin);
    until(fault.name, [&] { return watched.sample(fault.metric) == 1; });
    report.add(std::string(fault.name) + "_health_s", health_s, std::string(fault.meaning) + ": until /readyz says so");
    report.add(std::string(fault.name) + "_metrics_s", seconds_since(begin), "until the metrics do");
    watched.faults().mend();
    report.add(std::string(fault.name) + "_recovers_s",
               until(fault.name, [&] { return watched.page("/readyz").status == 200; }), "until it is ready again");
  }
  {
    WatchedDaemon watched(folder + "/clock", 1);
    watched.faults().set_clock(3600);
    report.add("clock_health_s",
               until("clock", [&] { return watched.page("/readyz").body.find("clock: set") != std::string::npos; }),
               "a clock that is set: until /readyz says so");
    report.add("clock_metrics_s", until("clock", [&] { return watched.sample("relmap_clock_steps_total") == 1; }),
               "then until the metrics do");
  }
  WatchedDaemon watched(folder + "/kill", 1);
  watched.daemon().process().signal(SIGKILL);
  report.add("kill_health_s", until("kill", [&] { return watched.page("/livez").status == 0; }),
             "kill -9: until nobody answers");
}

// Scrapes as fast as one client can, and not at all, in turn: what one costs is the difference.
void cost(const OperationsOptions& options, const std::string& folder, Report& report) {
  WatchedDaemon watched(folder + "/cost", options.robots);
  constexpr int kRounds = 4;
  std::vector<double> ms;
  double quiet_s = 0, scraped_s = 0;
  const milliseconds pause(20);
  for (int round = 0; round < 2 * kRounds; ++round) {
    const bool scrapes = round % 2 == 1;
    const double cpu = watched.daemon().process().cpu_seconds();
    const auto begin = Clock::now();
    while (seconds_since(begin) < options.seconds / kRounds) {
      if (scrapes) {
        const auto asked = Clock::now();
        if (watched.page("/metrics").status != 200) throw std::runtime_error("no metrics");
        ms.push_back(1e-3 * microseconds_since(asked));
      }
      std::this_thread::sleep_for(pause);
    }
    (scrapes ? scraped_s : quiet_s) += watched.daemon().process().cpu_seconds() - cpu;
  }
  const double each_s = (scraped_s - quiet_s) / static_cast<double>(ms.size());
  report.add("scrape_p50_ms", quantile(ms, 0.5), "a scrape, beside the fleet");
  report.add("scrape_p99_ms", quantile(ms, 0.99), "");
  report.add("scrape_cpu_ms", 1e3 * each_s, "the daemon's processor time of a scrape");
  report.add("scrape_bytes", static_cast<double>(watched.page("/metrics").body.size()), "of a page");
  report.add("metrics_core_share", each_s / kScrapeInterval_s, "of a core, with a scrape each 15 s");

  const auto begin = Clock::now();
  watched.daemon().process().signal(SIGTERM);
  const double not_serving_s = until("stop", [&] { return watched.page("/readyz").status != 200; });
  const auto code = watched.daemon().process().wait(std::chrono::minutes(2));
  if (code != 0) throw std::runtime_error("relmapd did not stop: " + watched.daemon().log());
  report.add("drain_not_ready_s", not_serving_s, "from SIGTERM until /readyz says so");
  report.add("drain_s", seconds_since(begin), "from SIGTERM until the process has ended, with the fleet there");
}

void run(const OperationsOptions& options, Report& report) {
  const storage::TemporaryFolder folder;
  faults(folder / "faults", report);
  cost(options, folder / "fleet", report);
}

}  // namespace

Run declare_operations(CLI::App& app) {
  auto options = std::make_shared<OperationsOptions>();
  app.add_option("--robots", options->robots, "of the fleet beside which cost is measured")->capture_default_str();
  app.add_option("--seconds", options->seconds, "with scrapes, and again without")->capture_default_str();
  return [options](Report& report) { run(*options, report); };
}

}  // namespace relmap::bench
