// Some robots of a fleet as a process of their own, which may be killed: each pushes keyframes into its spool at its
// rate until SIGTERM, then waits until all are settled. Started by `relmap-bench fleet`.
#include <optional>
#include <thread>

#include "frontend/publishing/publisher.h"
#include "proto/base/mutex.h"
#include "server/ops/signals.h"
#include "tools/bench/fleet/keyframes.h"
#include "tools/bench/fleet/keys.h"
#include "tools/bench/fleet/robot_transport.h"
#include "tools/bench/stopwatch.h"
#include "tools/bench/subcommand.h"

namespace relmap::bench {

namespace {

struct RobotsOptions {
  std::string folder, lcm, secret;
  std::uint32_t first = 0, count = 1, robots = 1;
  double rate = 5;
  std::int64_t start_us = 0;
  std::uint64_t seed = 1;
  std::size_t part_bytes = kNetworkPartBytes;
  int patience_s = 60;
};

// What SIGTERM sets.
class Stop {
 public:
  void set() {
    const MutexLock lock(mutex_);
    stopped_ = true;
    changed_.notify_all();
  }
  // False if it was set before.
  bool wait_until(Clock::time_point time) {
    const MutexLock lock(mutex_);
    return !changed_.wait_until(mutex_, time, [this]() RELMAP_REQUIRES(mutex_) { return stopped_; });
  }

 private:
  Mutex mutex_;
  ConditionVariable changed_;
  bool stopped_ RELMAP_GUARDED_BY(mutex_) = false;
};

class DrivingRobot {
 public:
  DrivingRobot(const RobotsOptions& options, std::uint32_t number, const FleetLap& lap, std::shared_ptr<SharedLcm> lcm,
               const DeedLog& log, Stop& stop)
      : options_(options), lap_(lap), log_(log), stop_(stop) {
    robot_ = {number, options.seed, start_of(number, options.robots), options.start_us,
              static_cast<std::int64_t>(1e6 / options.rate)};
    std::optional<access::RobotKey> key;
    if (!options.secret.empty()) key = key_of(access::key_of_hex(options.secret).value(), number);
    auto transport = std::make_unique<RobotTransport>(std::move(lcm), number, key, log);
    sent_bytes_ = transport->sent_bytes();
    publishing::PublisherOptions publishing;
    publishing.spool = options.folder + "/spool-" + std::to_string(number);
    publishing.live = true;
    publishing.part_bytes = options.part_bytes;
    publisher_ = publishing::Publisher::start(publishing, FleetLap::header(robot_), std::move(transport)).or_throw();
    thread_ = std::thread([this] { drive(); });
  }
  ~DrivingRobot() { thread_.join(); }

 private:
  void drive() {
    const std::chrono::microseconds period(robot_.period_us);
    std::uint32_t next = publisher_->next_sequence();
    SE3 T_odom;
    if (const auto last = publisher_->last_keyframe()) T_odom = last->T_odom_frame;
    note(Deed::Kind::kStarted, next);
    // Not all at the same time.
    auto due = Clock::now() + period * (robot_.number % options_.robots) / options_.robots;
    for (; stop_.wait_until(due); due += period) {
      const Keyframe keyframe = lap_.keyframe(robot_, next, T_odom);
      if (Status s = publisher_->push(keyframe); !s.ok()) throw StatusError(s);
      note(Deed::Kind::kPushed, next++);
      T_odom = keyframe.T_odom_frame;
    }
    const publishing::PublishSummary summary =
        publisher_->finish(Clock::now() + std::chrono::seconds(options_.patience_s));
    std::uint64_t refused = 0;
    for (const auto& [reason, count] : summary.refused) refused += count;
    note(Deed::Kind::kRefused, refused);
    note(Deed::Kind::kGivenUp, summary.gaps);
    note(Deed::Kind::kEnded, next);
  }

  void note(Deed::Kind kind, std::uint64_t number) const {
    log_.add({kind, robot_.number, number, *sent_bytes_, monotonic_ns()});
  }

  const RobotsOptions& options_;
  const FleetLap& lap_;
  const DeedLog& log_;
  Stop& stop_;
  FleetRobot robot_;
  std::shared_ptr<const std::atomic<std::uint64_t>> sent_bytes_;
  std::unique_ptr<publishing::Publisher> publisher_;
  std::thread thread_;
};

void run(const RobotsOptions& options) {
  ops::block_stop_signals();
  const FleetLap lap(options.folder + "/lap.bin");
  const DeedLog log(options.folder + "/deeds");
  const auto lcm = SharedLcm::open(options.lcm);
  Stop stop;
  std::vector<std::unique_ptr<DrivingRobot>> robots;
  for (std::uint32_t k = 0; k < options.count; ++k)
    robots.push_back(std::make_unique<DrivingRobot>(options, options.first + k, lap, lcm, log, stop));
  while (!ops::wait_for_signal(std::chrono::seconds(1))) {
  }
  stop.set();
}

}  // namespace

Run declare_fleet_robots(CLI::App& app) {
  auto options = std::make_shared<RobotsOptions>();
  app.add_option("--folder", options->folder, "folder of the fleet: lap.bin, deeds, spools")->required();
  app.add_option("--lcm", options->lcm, "LCM URL")->required();
  app.add_option("--secret", options->secret, "of the fleet's keys, in hexadecimal; none: nothing is sealed");
  app.add_option("--first", options->first, "number of the first of these robots");
  app.add_option("--count", options->count, "number of these robots");
  app.add_option("--robots", options->robots, "number of robots of the whole fleet");
  app.add_option("--rate", options->rate, "keyframes a second of each robot");
  app.add_option("--start-us", options->start_us, "time stamp of keyframe 0");
  app.add_option("--seed", options->seed, "seed of the fleet");
  app.add_option("--part-bytes", options->part_bytes, "bytes of the parts in which keyframes travel");
  app.add_option("--patience", options->patience_s, "seconds to wait at SIGTERM for what is not settled yet");
  return [options](Report&) { run(*options); };
}

}  // namespace relmap::bench
