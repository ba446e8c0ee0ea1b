// Watchers of the map beside a fleet, some of which read nothing: how long after a commit they have it, and what they
// cost the worker and the memory.
//
// Whoever watches works on the same cores and in the same caches as the worker, so a worker beside watchers is slower
// than one alone even if it does nothing for them. What it does for them is told by two daemons with equal fleets of
// which one is watched at a time, in turn: the load of the machine is always the same, and only whose worker is
// concerned differs.
//
// With --through-console the watchers are pages of a relmap-console beside the daemon, which asks it besides for what
// it draws.
#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "client/relmap_client.h"
#include "client/server_address.h"
#include "proto/base/clock.h"
#include "proto/base/quantile.h"
#include "relmap/v1/map.grpc.pb.h"
#include "storage/testing/temporary_folder.h"
#include "tests/support/running_daemon.h"
#include "tools/bench/console_pages.h"
#include "tools/bench/heard.h"
#include "tools/bench/stopwatch.h"
#include "tools/bench/streaming_robots.h"
#include "tools/bench/subcommand.h"

namespace relmap::bench {

namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;
using testing::RunningDaemon;

constexpr double kSentEach_hz = 2;  // keyframes a second of each robot
constexpr double kSettle_s = 1;     // of each phase, not measured

struct WatchBenchOptions {
  std::uint32_t robots = 20, watchers = 50, stalled = 10;
  double seconds = 3;  // of a phase
  std::uint32_t rounds = 12;
  std::size_t memory_budget_mb = 1024;
  bool through_console = false;
};

// A daemon to which robots send all the time.
class WatchedFleet {
 public:
  WatchedFleet(const std::string& folder, const WatchBenchOptions& options)
      : folder_(folder),
        // Without closures the worker is the thread that works most.
        daemon_({.data = folder + "/map",
                 .lcm = "",
                 .memory_budget_mb = options.memory_budget_mb,
                 .more = {"--no-closures"}}) {
    const std::uint32_t robots = std::max(1u, options.robots / 2);
    robots_.emplace(folder, data(), robots, kSentEach_hz);
    const auto begin = Clock::now();
    const auto client = daemon_.client();
    while (client->status().or_throw().frames < 4 * robots) {
      if (seconds_since(begin) > 300) throw std::runtime_error("the robots do not send: " + daemon_.log());
      std::this_thread::sleep_for(milliseconds(100));
    }
  }

  RunningDaemon& daemon() { return daemon_; }
  const std::string& folder() const { return folder_; }
  std::string data() const { return folder_ + "/map"; }

  // Processor time of each thread so far, by its number.
  std::map<std::string, double> thread_seconds() {
    std::map<std::string, double> spent;
    for (const auto& task : fs::directory_iterator("/proc/" + std::to_string(daemon_.process().pid()) + "/task")) {
      std::ifstream file(task.path() / "schedstat");
      double ns = 0;
      if (file >> ns) spent[task.path().filename()] = 1e-9 * ns;
    }
    return spent;
  }

 private:
  const std::string folder_;
  RunningDaemon daemon_;
  std::optional<StreamingRobots> robots_;
};

// Watchers who read, each in a thread of its own, and others who do not.
class Onlookers {
 public:
  Onlookers(const std::string& server, const WatchBenchOptions& options, Heard& heard) : heard_(heard) {
    const auto address = client::resolve_server(server).or_throw().address;
    for (std::uint32_t i = 0; i < options.stalled; ++i) {
      grpc::ChannelArguments arguments;
      arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
      asleep_.push_back(std::make_unique<Asleep>());
      Asleep& one = *asleep_.back();
      one.stub = v1::Map::NewStub(grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments));
      v1::WatchMapRequest request;
      request.set_from(v1::WATCH_FROM_OLDEST);
      one.reader = one.stub->WatchMap(&one.context, request);
    }
    for (std::uint32_t i = options.stalled; i < options.watchers; ++i)
      threads_.emplace_back([this, server] { watch(server); });
    const auto begin = Clock::now();
    while (begun_ < threads_.size()) {
      if (seconds_since(begin) > 120) throw std::runtime_error("watchers do not catch up");
      std::this_thread::sleep_for(milliseconds(10));
    }
  }
  ~Onlookers() {
    stop_ = true;
    for (std::thread& thread : threads_) thread.join();
    for (const auto& one : asleep_) one->context.TryCancel();
  }

 private:
  struct Asleep {
    grpc::ClientContext context;
    std::unique_ptr<v1::Map::Stub> stub;
    std::unique_ptr<grpc::ClientReader<v1::MapEvent>> reader;
  };

  void watch(const std::string& server) {
    const auto client = client::Client::connect(server).or_throw();
    client::WatchOptions options;
    options.stopped = [this] { return stop_.load(); };
    HeardByOne heard(heard_);
    const Status watched = client->watch(options, [&](const client::WatchEvent& event) {
      const auto* caught_up = std::get_if<client::CaughtUp>(&event.what);
      if (!caught_up) {
        heard.event();
        return Status();
      }
      if (!heard.has_caught_up()) ++begun_;
      heard.caught_up(caught_up->journal_sequence, caught_up->time_us, now_us());
      return Status();
    });
    if (!watched.ok()) std::fprintf(stderr, "a watch failed: %s\n", watched.to_string().c_str());
  }

  Heard& heard_;
  std::atomic<bool> stop_{false};
  std::atomic<std::size_t> begun_{0};
  std::vector<std::unique_ptr<Asleep>> asleep_;
  std::vector<std::thread> threads_;
};

struct Phase {
  std::map<std::string, double> threads_s;
  double process_s = 0, seconds = 0;
  std::uint64_t frames = 0;

  void add(const Phase& other) {
    for (const auto& [thread, s] : other.threads_s) threads_s[thread] += s;
    process_s += other.process_s;
    seconds += other.seconds;
    frames += other.frames;
  }
  double per_frame_us(double s) const { return 1e6 * s / static_cast<double>(frames); }
  double worker_us(const std::string& worker) const { return per_frame_us(threads_s.at(worker)); }
};

// A daemon while something is measured.
class Measured {
 public:
  explicit Measured(WatchedFleet& fleet) : fleet_(fleet), client_(fleet.daemon().client()) {}

  void begin() {
    threads_ = fleet_.thread_seconds();
    cpu_ = fleet_.daemon().process().cpu_seconds();
    frames_ = client_->status().or_throw().frames;
    begun_ = Clock::now();
  }
  Phase end() {
    Phase phase;
    phase.seconds = seconds_since(begun_);
    phase.frames = client_->status().or_throw().frames - frames_;
    phase.process_s = fleet_.daemon().process().cpu_seconds() - cpu_;
    for (const auto& [thread, s] : fleet_.thread_seconds())
      if (const auto found = threads_.find(thread); found != threads_.end())
        phase.threads_s[thread] = s - found->second;
    if (phase.frames == 0) throw std::runtime_error("no keyframe came in a phase; --seconds is too short");
    return phase;
  }
  client::Client& client() { return *client_; }

 private:
  WatchedFleet& fleet_;
  const std::unique_ptr<client::Client> client_;
  std::map<std::string, double> threads_;
  double cpu_ = 0;
  std::uint64_t frames_ = 0;
  Clock::time_point begun_;
};

// Of the memory for replies, the part that is used.
double replies_share(client::Client& client) {
  for (const client::MemoryShare& share : client.status().or_throw().memory_shares)
    if (share.name == "replies") return static_cast<double>(share.used) / static_cast<double>(share.allowance);
  throw std::runtime_error("no share is called replies");
}

// What one daemon did, phase by phase.
struct Record {
  std::vector<Phase> alone, other_watched, watched;  // nobody watches; the other daemon is watched; it is watched
};

// The thread that works most while nobody watches.
std::string worker_of(const Record& record) {
  Phase all;
  for (const Phase& phase : record.alone) all.add(phase);
  return std::max_element(all.threads_s.begin(), all.threads_s.end(),
                          [](const auto& a, const auto& b) { return a.second < b.second; })
      ->first;
}

void run(const WatchBenchOptions& options, Report& report) {
  const storage::TemporaryFolder folder;
  WatchedFleet fleets[] = {WatchedFleet(folder / "one", options), WatchedFleet(folder / "other", options)};
  Measured daemons[] = {Measured(fleets[0]), Measured(fleets[1])};
  Record records[2];
  constexpr int kNobody = 2;
  std::vector<double> ms;
  double share = 0, resident_bytes = 0, watched_s = 0, console_s = 0;
  std::size_t console_bytes = 0;
  std::uint64_t events = 0, frames = 0, requests = 0;
  const auto phase = [&](int watched) {
    const auto resident = [&] {
      return static_cast<double>(daemons[watched].client().status().or_throw().resident_bytes);
    };
    const double before = watched == kNobody ? 0 : resident();
    Heard heard;
    std::optional<Onlookers> onlookers;
    std::optional<ConsolePages> pages;
    if (watched != kNobody && options.through_console)
      pages.emplace(fleets[watched].folder(), fleets[watched].data(), options.watchers, options.stalled, heard);
    else if (watched != kNobody)
      onlookers.emplace(fleets[watched].data(), options, heard);
    std::this_thread::sleep_for(std::chrono::duration<double>(kSettle_s));
    for (Measured& daemon : daemons) daemon.begin();
    const double console_before = pages ? pages->console_cpu_seconds() : 0;
    const std::uint64_t requests_before = pages ? pages->requests() : 0;
    const std::uint64_t events_before = heard.events();
    std::this_thread::sleep_for(std::chrono::duration<double>(options.seconds));
    if (pages) {
      console_s += pages->console_cpu_seconds() - console_before;
      requests += pages->requests() - requests_before;
      console_bytes = std::max(console_bytes, pages->console_peak_bytes());
    }
    events += heard.events() - events_before;
    for (int d = 0; d < 2; ++d) {
      const Phase told = daemons[d].end();
      (watched == kNobody ? records[d].alone
       : watched == d     ? records[d].watched
                          : records[d].other_watched)
          .push_back(told);
      if (watched != d) continue;
      watched_s += told.seconds;
      frames += told.frames;
    }
    if (watched == kNobody) return;
    if (pages) pages->throw_if_one_failed();
    share = std::max(share, replies_share(daemons[watched].client()));
    resident_bytes = std::max(resident_bytes, resident() - before);
    const auto more = heard.latencies_ms();
    ms.insert(ms.end(), more.begin(), more.end());
  };
  for (std::uint32_t round = 0; round < options.rounds; ++round) {
    // In turn, since a map that grows costs more.
    phase(kNobody);
    for (int half = 0; half < 2; ++half) phase((half + static_cast<int>(round)) % 2);
  }
  if (ms.empty()) throw std::runtime_error("nobody heard of a commit");

  std::vector<double> alone_us, other_us, watched_us, ratios, daemon_us, daemon_watched_us, daemon_ratios;
  for (const Record& record : records) {
    const std::string worker = worker_of(record);
    for (std::uint32_t round = 0; round < options.rounds; ++round) {
      alone_us.push_back(record.alone[round].worker_us(worker));
      other_us.push_back(record.other_watched[round].worker_us(worker));
      watched_us.push_back(record.watched[round].worker_us(worker));
      ratios.push_back(watched_us.back() / other_us.back());
      daemon_us.push_back(record.other_watched[round].per_frame_us(record.other_watched[round].process_s));
      daemon_watched_us.push_back(record.watched[round].per_frame_us(record.watched[round].process_s));
      daemon_ratios.push_back(daemon_watched_us.back() / daemon_us.back());
    }
  }
  report.add("watchers", options.watchers, "of the map, and");
  report.add("stalled", options.stalled, "of them that read nothing");
  report.add("robots", options.robots, "that send, half of them to a daemon that is not watched");
  report.add("keyframes_per_s", static_cast<double>(frames) / watched_s,
             "of the robots of the watched daemon together");
  report.add("commit_to_client_p50_ms", quantile(ms, 0.5), "from a commit until a watcher has all of it");
  report.add("commit_to_client_p99_ms", quantile(ms, 0.99), "");
  report.add("commit_to_client_max_ms", quantile(ms, 1), "");
  report.add("messages_per_s", static_cast<double>(events) / watched_s, "told to all watchers that read");
  report.add("worker_us", quantile(other_us, 0.5),
             "the worker's processor time of a keyframe, while the other map is watched");
  report.add("worker_watched_us", quantile(watched_us, 0.5), "while its own is");
  report.add("worker_ratio", quantile(ratios, 0.5), "of these two, round by round: the median,");
  report.add("worker_ratio_p25", quantile(ratios, 0.25), "and the middle half");
  report.add("worker_ratio_p75", quantile(ratios, 0.75), "");
  report.add("worker_alone_us", quantile(alone_us, 0.5),
             "while nobody watches, so that cores and caches are the worker's");
  report.add("daemon_us", quantile(daemon_us, 0.5),
             "the daemon's processor time of a keyframe, while the other map is watched");
  report.add("daemon_watched_us", quantile(daemon_watched_us, 0.5), "while its own is");
  report.add("daemon_ratio", quantile(daemon_ratios, 0.5), "of these two, round by round: the median,");
  report.add("daemon_ratio_p25", quantile(daemon_ratios, 0.25), "and the middle half");
  report.add("daemon_ratio_p75", quantile(daemon_ratios, 0.75), "");
  report.add("replies_share", share, "of the memory for replies that is used, all watches and calls together");
  report.add("resident_growth_mb", 1e-6 * resident_bytes, "while they watch");
  if (!options.through_console) return;
  report.add("console_cores", console_s / watched_s, "the console's processor time of a second");
  report.add("console_requests_per_s", static_cast<double>(requests) / watched_s, "of all pages, beside the streams");
  report.add("console_peak_mb", 1e-6 * static_cast<double>(console_bytes), "of its resident memory");
}

}  // namespace

Run declare_watch(CLI::App& app) {
  auto options = std::make_shared<WatchBenchOptions>();
  app.add_option("--robots", options->robots,
                 "that send 2 keyframes a second each, half of them to each of two daemons")
      ->capture_default_str();
  app.add_option("--watchers", options->watchers, "of the map")->capture_default_str();
  app.add_option("--stalled", options->stalled, "of them, that read nothing")->capture_default_str();
  app.add_option("--seconds", options->seconds, "of a phase: nobody watches, one map is watched, the other is")
      ->capture_default_str();
  app.add_option("--rounds", options->rounds, "of the three phases")->capture_default_str();
  app.add_flag("--through-console", options->through_console,
               "Watchers are pages of a relmap-console, which ask what the Map view asks, as often");
  app.add_option("--memory-budget-mb", options->memory_budget_mb, "of the daemon")->capture_default_str();
  return [options](Report& report) { run(*options, report); };
}

}  // namespace relmap::bench
