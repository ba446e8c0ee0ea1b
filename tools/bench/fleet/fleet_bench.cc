// A fleet of robots over a bad network into a daemon that is a process of its own: nothing lost, nothing twice, how
// soon acknowledged, at what cost. Robots are the front-end's publisher with its spool; LCM is LCM; between robots and
// daemon stands a relay that loses, holds back and doubles packets.
#include "tools/bench/fleet/fleet_bench.h"

#include <signal.h>
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <limits>
#include <optional>
#include <stdexcept>
#include <thread>

#include "proto/access/file.h"
#include "proto/base/clock.h"
#include "proto/keyframe/ingest_messages.h"
#include "storage/testing/temporary_folder.h"
#include "tests/support/private_network.h"
#include "tests/support/running_daemon.h"
#include "tools/bench/fleet/batch.h"
#include "tools/bench/fleet/evaluation.h"
#include "tools/bench/fleet/keys.h"
#include "tools/bench/fleet/killed_daemon.h"
#include "tools/bench/fleet/relay.h"
#include "tools/bench/fleet/trouble.h"
#include "tools/bench/stopwatch.h"
#include "tools/bench/subcommand.h"

namespace relmap::bench {

namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::Process;
using testing::RunningDaemon;

double own_cpu_seconds() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  const auto s = [](const timeval& t) { return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec); };
  return s(usage.ru_utime) + s(usage.ru_stime);
}

// Robots to be killed are processes of their own; the others share one.
class FleetProcesses {
 public:
  FleetProcesses(const FleetOptions& options, std::string folder, std::string lcm)
      : options_(options),
        folder_(std::move(folder)),
        lcm_(std::move(lcm)),
        secret_(options.sealed ? read_secret(folder_) : ""),
        start_us_(now_us()) {
    for (std::uint32_t k = 0; k < options.kill_robots; ++k) processes_.push_back(start(k, 1));
    if (options.robots > options.kill_robots)
      processes_.push_back(start(options.kill_robots, options.robots - options.kill_robots));
  }

  std::int64_t restart(std::uint32_t robot) {
    cpu_before_ += processes_[robot]->cpu_seconds();
    processes_[robot]->kill();
    const std::int64_t at = monotonic_ns();
    processes_[robot] = start(robot, 1);
    return at;
  }

  double cpu() const {
    double cpu = cpu_before_;
    for (const auto& process : processes_) cpu += process->cpu_seconds();
    return cpu;
  }
  void check() const {
    for (const auto& process : processes_)
      if (!process->running()) throw std::runtime_error("robots ended: " + testing::read_text(folder_ + "/robots.log"));
  }
  // Makes no more keyframes, and ends when all are settled, or after a minute.
  void finish() {
    for (const auto& process : processes_) process->signal(SIGTERM);
    for (const auto& process : processes_)
      if (process->wait(seconds(90)) != 0)
        std::cerr << "robots did not end as they should: " << testing::read_text(folder_ + "/robots.log") << '\n';
  }

  FleetRobot robot(std::uint32_t number) const {
    return {number, options_.seed, start_of(number, options_.robots), start_us_,
            static_cast<std::int64_t>(1e6 / options_.rate)};
  }

 private:
  std::unique_ptr<Process> start(std::uint32_t first, std::uint32_t count) const {
    const auto text = [](auto number) { return std::to_string(number); };
    std::vector<std::string> command{"/proc/self/exe", "fleet-robots",
                                     "--folder",       folder_,
                                     "--lcm",          lcm_,
                                     "--first",        text(first),
                                     "--count",        text(count),
                                     "--robots",       text(options_.robots),
                                     "--rate",         text(options_.rate),
                                     "--start-us",     text(start_us_),
                                     "--seed",         text(options_.seed),
                                     "--part-bytes",   text(options_.part_bytes)};
    if (!secret_.empty()) command.insert(command.end(), {"--secret", secret_});
    return std::make_unique<Process>(
        command, testing::ProcessOptions{.standard_output = "", .standard_error = folder_ + "/robots.log"});
  }

  const FleetOptions& options_;
  static std::string read_secret(const std::string& folder) {
    return hex(access::read_secret(folder + "/credentials/lcm.key").or_throw());
  }

  const std::string folder_, lcm_, secret_;
  const std::int64_t start_us_;
  std::vector<std::unique_ptr<Process>> processes_;
  double cpu_before_ = 0;
};

// Kills, evenly over the middle of the run; those of the daemon among those of robots.
struct Kill {
  double at = 0;  // share of the run
  std::optional<std::uint32_t> robot;
};
std::vector<Kill> plan_kills(const FleetOptions& options) {
  constexpr double kFirst = 0.1, kLast = 0.9;
  const std::uint32_t of_robots = options.kill_robots * options.kills_each;
  std::vector<Kill> kills;
  const auto spread = [&](std::uint32_t k, std::uint32_t count) {
    return kFirst + (kLast - kFirst) * (k + 0.5) / count;
  };
  for (std::uint32_t k = 0; k < options.kill_daemon; ++k) kills.push_back({spread(k, options.kill_daemon), {}});
  for (std::uint32_t k = 0; k < of_robots; ++k) kills.push_back({spread(k, of_robots), k % options.kill_robots});
  std::sort(kills.begin(), kills.end(), [](const Kill& a, const Kill& b) { return a.at < b.at; });
  return kills;
}

std::pair<std::string, std::string> two_groups() {
  const std::string a = testing::random_lcm_url();
  for (;;) {
    const std::string b = testing::random_lcm_url();
    // LCM hears whatever comes to its port, of any group.
    if (b.substr(b.rfind(':')) != a.substr(a.rfind(':'))) return {a, b};
  }
}

void wait_until_all_are_heard(const FleetProcesses& processes, const FleetOptions& options, const std::string& deeds) {
  const auto deadline = Clock::now() + seconds(60);
  for (;; std::this_thread::sleep_for(milliseconds(50))) {
    std::uint32_t heard = 0;
    for (const auto& [number, robot] : by_robot(read_deeds(deeds))) heard += robot.acknowledged > 0;
    if (heard == options.robots) return;
    processes.check();
    if (Clock::now() > deadline)
      throw std::runtime_error("only " + std::to_string(heard) + " robots have been heard in a minute");
  }
}

// Waits until the map has everything that the daemon has acknowledged (lookups may be left), and returns the seconds.
double wait_until_applied(client::Client& client) {
  const auto begin = Clock::now();
  for (;; std::this_thread::sleep_for(milliseconds(20))) {
    const client::DaemonStatus status = client.status().or_throw();
    const auto now = Clock::now();
    if (status.applied_sequence >= status.durable_sequence) return std::chrono::duration<double>(now - begin).count();
    if (now - begin > seconds(120))
      throw std::runtime_error("what was acknowledged has not been applied in two minutes");
  }
}

// One run, from the start of the daemon to the check of the map.
class FleetRun {
 public:
  explicit FleetRun(const FleetOptions& options)
      : options_(options),
        folder_(options.folder.empty() ? temporary_ / "fleet" : options.folder),
        groups_(two_groups()),
        relay_(groups_.first, groups_.second, options.seed),
        lap_(make_lap(folder_, options)),
        credentials_(options.sealed ? make_credentials(folder_, options) : ""),
        daemon_(daemon_options()),
        processes_(options, folder_, groups_.first) {
    wait_until_all_are_heard(processes_, options, folder_ + "/deeds");
  }

  // The seconds asked for, from whose beginning all is as bad as asked for.
  void drive() {
    relay_.begin_faults(options_.faults);
    make_trouble();
    begin_ns_ = monotonic_ns();
    daemon_cpu_at_begin_ = daemon_.cpu();
    const double robots_cpu = processes_.cpu(), own_cpu = own_cpu_seconds();
    for (const Kill& kill : plan_kills(options_)) {
      wait_until(kill.at);
      if (kill.robot)
        robot_restarts_ns_.emplace_back(*kill.robot, processes_.restart(*kill.robot));
      else
        daemon_restarts_ns_.push_back(daemon_.restart());
    }
    wait_until(1);
    processes_.check();
    end_ns_ = monotonic_ns();
    const double percent = 100 / (1e-9 * static_cast<double>(end_ns_ - begin_ns_));
    cpu_percent_ = (daemon_.cpu() - daemon_cpu_at_begin_) * percent;
    std::cerr << "robots: " << (processes_.cpu() - robots_cpu) * percent
              << " % of a core; relay and trouble: " << (own_cpu_seconds() - own_cpu) * percent << " %\n";
  }

  // Waits until robots and map are up to date.
  void settle() {
    say_what_passed();
    processes_.finish();
    flooder_.reset();
    garbage_.reset();
    if (forger_) forgeries_ = forger_->sent();
    forger_.reset();
    applied_s_ = wait_until_applied(*daemon_.running().client());
    client::ClientOptions patient;
    patient.deadline = std::chrono::minutes(10);
    const Status idle = client::Client::connect(folder_ + "/map", patient).or_throw()->wait_idle();
    if (!idle.ok()) throw StatusError(idle);
    daemon_cpu_s_ = daemon_.cpu() - daemon_cpu_at_begin_;
  }

  void report(Report& report) {
    const auto robots = by_robot(read_deeds(folder_ + "/deeds"));
    report_counts(robots, report);
    report_acknowledgements(robots, report);
    report.add("cpu_percent", cpu_percent_, "of the daemon; 100: one core");
    const double cpu_ms = 1e3 * daemon_cpu_s_ / static_cast<double>(pushed_since(robots, begin_ns_));
    report.add("cpu_ms_per_keyframe", cpu_ms, "of the daemon, until all that was pushed is relaxed and looked up");
    report.add("daemon_resident_mb", daemon_.peak_resident_mb(), "at most");
    report.add("memory_budget_mb", static_cast<double>(options_.memory_budget_mb), "");
    report.add("applied_s", applied_s_, "from the last acknowledgement until the map showed all of it");
    daemon_.stop();
  }

 private:
  static FleetLap make_lap(const std::string& folder, const FleetOptions& options) {
    std::filesystem::create_directories(folder);
    FleetLap::make(folder + "/lap.bin", options.keyframe_bytes, options.seed);
    return FleetLap(folder + "/lap.bin");
  }

  // Issues keys to all robots, and returns the folder.
  static std::string make_credentials(const std::string& folder, const FleetOptions& options) {
    const std::string made = folder + "/credentials";
    const testing::Finished ca =
        testing::run_program({testing::built_program("relmap-admin"), "credentials", "ca", made});
    if (ca.exit_code != 0) throw std::runtime_error("relmap-admin credentials: " + ca.standard_error);
    access::AccessList list = access::read_access_list(made + "/access").or_throw();
    for (std::uint32_t robot = 0; robot <= forger(options); ++robot) list.add(grant_of({.number = robot}));
    if (const Status written = access::write_private_file(made + "/access", list.text()); !written.ok())
      throw StatusError(written);
    return made;
  }

  testing::DaemonOptions daemon_options() const {
    testing::DaemonOptions daemon{
        .data = folder_ + "/map", .lcm = groups_.second, .memory_budget_mb = options_.memory_budget_mb, .more = {}};
    if (!options_.closures) daemon.more.push_back("--no-closures");
    daemon.credentials = credentials_;
    return daemon;
  }

  // The number of a robot that drives nowhere.
  static std::uint32_t forger(const FleetOptions& options) { return options.robots + 1; }

  FleetRobot flooding_robot() const { return processes_.robot(options_.robots); }

  void make_trouble() {
    const double rate = options_.rate * options_.flood;
    if (rate > 0) {
      FleetRobot robot = flooding_robot();
      robot.period_us = std::max<std::int64_t>(1, std::llround(1e6 / rate));
      flooder_ = std::make_unique<Flooder>(groups_.first, lap_, robot, rate, options_.part_bytes);
    }
    if (options_.garbage_hz > 0)
      garbage_ = std::make_unique<GarbageSender>(groups_.first, options_.garbage_hz, options_.seed);
    if (options_.forgeries_hz > 0) {
      std::vector<SessionUuid> sessions;
      for (std::uint32_t robot = 0; robot < options_.robots; ++robot)
        sessions.push_back(processes_.robot(robot).uuid());
      const access::SealKey secret = access::read_secret(credentials_ + "/lcm.key").or_throw();
      forger_ = std::make_unique<Forger>(groups_.first, std::move(sessions), key_of(secret, forger(options_)),
                                         options_.forgeries_hz, options_.seed);
    }
  }

  void wait_until(double share) const {
    const auto ns = begin_ns_ + static_cast<std::int64_t>(1e9 * options_.seconds * share);
    std::this_thread::sleep_until(Clock::time_point(std::chrono::nanoseconds(ns)));
  }

  void say_what_passed() const {
    const RelayCounts passed = relay_.counts();
    std::cerr << "relay: " << passed.datagrams << " datagrams, " << passed.lost << " lost, " << passed.late << " late, "
              << passed.doubled << " doubled\n";
    if (passed.overflowed > 0)
      std::cerr << "relay: " << passed.overflowed
                << " more were lost: the kernel dropped what the relay could not carry\n";
    if (flooder_) std::cerr << "flood: " << flooder_->sent() << " keyframes sent\n";
    if (garbage_) std::cerr << "garbage: " << garbage_->sent() << " messages sent\n";
    if (forger_) std::cerr << "forgeries: " << forger_->sent() << " messages sent\n";
  }

  void report_counts(const std::map<std::uint32_t, RobotDeeds>& robots, Report& report) {
    std::vector<std::pair<FleetRobot, std::uint64_t>> sent;
    double all = 0, acknowledged = 0, refused = 0, given_up = 0, part_bytes = 0;
    for (const auto& [number, robot] : robots) {
      sent.emplace_back(processes_.robot(number), robot.sent);
      all += static_cast<double>(robot.sent);
      acknowledged += static_cast<double>(robot.acknowledged);
      refused += static_cast<double>(robot.refused);
      given_up += static_cast<double>(robot.given_up);
      part_bytes += static_cast<double>(robot.part_bytes);
    }
    const auto client = daemon_.running().client();
    const MapTally tally = tally_map(*client, sent, flooding_robot());
    const double keyframe_bytes =
        static_cast<double>(encode_keyframe(lap_.keyframe(processes_.robot(0), 1, {})).size());

    report.add("robots", options_.robots, "");
    report.add("sent", all, "keyframes in the robots' spools");
    report.add("acknowledged", acknowledged, "as the robots have heard");
    report.add("lost", static_cast<double>(tally.missing) - refused - given_up,
               "sent, and neither in the map nor refused or given up as its robot was told");
    report.add("doubled", static_cast<double>(tally.doubled), "frames beyond one for a robot and sequence");
    report.add("strange", static_cast<double>(tally.strange), "frames in the map that nobody sent");
    report.add("refused", refused, "");
    report.add("given_up", given_up, "");
    report.add("resent_share", 1 - all * keyframe_bytes / part_bytes, "of the bytes of parts: those sent again");
    report.add("closures", static_cast<double>(client->status().or_throw().closures_accepted), "in force at the end");
    if (options_.forgeries_hz > 0) {
      const client::ReasonCounts not_taken = client->status().or_throw().not_taken;
      double refused_forgeries = 0;
      for (const Reason reason : {Reason::UNAUTHENTICATED, Reason::NOT_ALLOWED, Reason::REPLAYED})
        if (const auto count = not_taken.find(reason); count != not_taken.end())
          refused_forgeries += static_cast<double>(count->second);
      report.add("forgeries_sent", static_cast<double>(forgeries_), "in the robots' and the daemon's name");
      report.add("forgeries_refused", refused_forgeries, "by the daemon; what is in its name it does not hear");
    }
    if (options_.flood > 0)
      report.add("flood_frames", static_cast<double>(tally.flooded), "of the flooding robot in the map");
  }

  void report_acknowledgements(const std::map<std::uint32_t, RobotDeeds>& robots, Report& report) const {
    const std::vector<double> latencies = latencies_ms(robots, begin_ns_, end_ns_);
    report.add("ack_p50_ms", quantile(latencies, 0.5), "from push()'s return to the acknowledgement heard");
    report.add("ack_p99_ms", quantile(latencies, 0.99), "over all robots");
    report.add("ack_max_ms", quantile(latencies, 1), "");
    report.add("waiting_at_end", static_cast<double>(waiting_at(robots, end_ns_)),
               "keyframes pushed and not acknowledged when the run ended");
    report.add("settled_s", settled_after_s(robots, end_ns_), "from the end of the run until all was acknowledged");
    std::vector<double> of_daemon, of_robots;
    for (const std::int64_t at : daemon_restarts_ns_) of_daemon.push_back(settled_after_s(robots, at));
    for (const auto& [robot, at] : robot_restarts_ns_) of_robots.push_back(settled_after_s(robots.at(robot), at));
    if (!of_daemon.empty())
      report.add("settled_after_restart_s", of_daemon, "of the daemon: until all pushed before was acknowledged");
    if (!of_robots.empty())
      report.add("settled_after_robot_restart_s", of_robots, "of a robot: until all it had pushed was acknowledged");
  }

  const FleetOptions& options_;
  const storage::TemporaryFolder temporary_;
  const std::string folder_;
  const std::pair<std::string, std::string> groups_;  // LCM URLs: of the robots, of the daemon
  Relay relay_;
  const FleetLap lap_;
  const std::string credentials_;  // folder; empty: nothing is sealed
  KilledDaemon daemon_;
  FleetProcesses processes_;
  std::unique_ptr<Flooder> flooder_;
  std::unique_ptr<GarbageSender> garbage_;
  std::unique_ptr<Forger> forger_;
  std::size_t forgeries_ = 0;

  std::int64_t begin_ns_ = 0, end_ns_ = 0;
  double daemon_cpu_at_begin_ = 0, daemon_cpu_s_ = 0, cpu_percent_ = 0, applied_s_ = 0;
  std::vector<std::int64_t> daemon_restarts_ns_;
  std::vector<std::pair<std::uint32_t, std::int64_t>> robot_restarts_ns_;
};

// A tenth as many with all background work of the daemon.
void report_batch(const FleetOptions& options, Report& report) {
  BatchSpeed journal, map, full;
  journal.durable_per_s = map.done_per_s = full.done_per_s = std::numeric_limits<double>::quiet_NaN();
  if (options.batch > 0) {
    const storage::TemporaryFolder folder;
    BatchLoad load;
    load.keyframes = options.batch;
    load.memory_budget_mb = options.memory_budget_mb;
    load.seed = options.seed;
    load.relax = load.closures = false;
    journal = map = run_batch(folder / "bare", load);
    load.keyframes /= 10;
    load.relax = load.closures = true;
    full = run_batch(folder / "full", load);
  }
  report.add("batch_frames_per_s", journal.durable_per_s, "durable; ready made, light; nothing relaxed, no places");
  report.add("batch_applied_frames_per_s", map.done_per_s, "the same until the map has them");
  report.add("batch_full_frames_per_s", full.done_per_s, "until all are relaxed and looked up");
}

void run(const FleetOptions& options, Report& report) {
  if (options.kill_robots > options.robots) throw std::runtime_error("more robots to be killed than there are");
  if (!testing::enter_private_network(testing::Multicast::kOnLoopback))
    std::cerr << "no network namespace may be made here: random multicast groups of this machine instead\n";
  if (options.forgeries_hz > 0 && !options.sealed) throw std::runtime_error("--forgeries needs --sealed");
  run_fleet(options, report);
  report_batch(options, report);
}

}  // namespace

void run_fleet(const FleetOptions& options, Report& report) {
  FleetRun fleet(options);
  fleet.drive();
  fleet.settle();
  fleet.report(report);
}

Run declare_fleet(CLI::App& app) {
  auto options = std::make_shared<FleetOptions>();
  const auto share = CLI::Range(0.0, 1.0);
  app.footer(
      "Examples:\n"
      "  relmap-bench fleet --json   # 20 robots, 5 minutes of a bad network\n"
      "  relmap-bench fleet --seconds 30 --kill-daemon 3 --kill-robots 5 --kills-each 2\n"
      "  relmap-bench fleet --seconds 30 --flood 100 --garbage 200   # two who make trouble for the others\n\n"
      "A keyframe is sent when push() has returned: then it is in its robot's spool. Everything happens in a network\n"
      "namespace that is gone afterwards; where none may be made, in random multicast groups of this machine.");
  app.add_option("--robots", options->robots, "number of robots, each with its own spool")->capture_default_str();
  app.add_option("--rate", options->rate, "keyframes a second of each robot")->capture_default_str();
  app.add_option("--seconds", options->seconds, "seconds during which robots make keyframes")->capture_default_str();
  app.add_option("--loss", options->faults.loss,
                 "share of 1,500-byte packets lost, either way; a datagram is lost "
                 "with any of its packets")
      ->check(share)
      ->capture_default_str();
  app.add_option("--reorder", options->faults.late, "share of datagrams held back for 2 to 10 ms")
      ->check(share)
      ->capture_default_str();
  app.add_option("--double", options->faults.doubled, "share of datagrams that are delivered twice")
      ->check(share)
      ->capture_default_str();
  app.add_option("--keyframe-bytes", options->keyframe_bytes, "bytes of each keyframe, a seventh of them a picture")
      ->check(CLI::Range(5'000, 150'000))
      ->capture_default_str();
  app.add_option("--part-bytes", options->part_bytes, "bytes of the parts in which keyframes travel")
      ->capture_default_str();
  app.add_option("--kill-daemon", options->kill_daemon, "kill relmapd (kill -9) and start it again so many times")
      ->capture_default_str();
  app.add_option("--kill-robots", options->kill_robots, "kill so many robots (kill -9) and start them again")
      ->capture_default_str();
  app.add_option("--kills-each", options->kills_each, "kill each of these robots so many times")->capture_default_str();
  app.add_option("--flood", options->flood, "one more robot sends at so many times the rate, and ignores its credits")
      ->capture_default_str();
  app.add_option("--garbage", options->garbage_hz, "send so many meaningless or harmful messages a second")
      ->capture_default_str();
  app.add_option("--budget-mb", options->memory_budget_mb, "memory budget of relmapd")->capture_default_str();
  app.add_option("--forgeries", options->forgeries_hz,
                 "with --sealed: another robot forges, spoils and repeats so many messages of the others a second")
      ->capture_default_str();
  app.add_flag("--sealed", options->sealed, "robots prove who they are, and nothing else is believed");
  app.add_flag("!--no-closures", options->closures, "relmapd recognises no places");
  app.add_option("--batch", options->batch,
                 "afterwards, send so many ready-made keyframes as fast as they are taken; 0: none")
      ->capture_default_str();
  app.add_option("--seed", options->seed, "seed of faults and keyframes")->capture_default_str();
  app.add_option("--folder", options->folder, "folder for map and spools, which is kept (default: a temporary one)");
  return [options](Report& report) { run(*options, report); };
}

}  // namespace relmap::bench
