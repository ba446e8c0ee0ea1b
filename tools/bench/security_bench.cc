// What security costs, and what those who mean harm can do to others: seals over LCM, TLS, forgeries, crowds of callers
// and strangers' sessions. Figures of one run are ratios against the same without, or times that others have to wait.
#include <algorithm>
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "frontend/publishing/lcm/lcm_transport.h"
#include "frontend/publishing/publisher.h"
#include "proto/access/credentials.h"
#include "proto/base/crc32c.h"
#include "proto/base/quantile.h"
#include "proto/keyframe/keyframe_samples.h"
#include "proto/wire/channels.h"
#include "proto/wire/lcm_messages.h"
#include "storage/testing/temporary_folder.h"
#include "tests/support/private_network.h"
#include "tests/support/raw_http2.h"
#include "tests/support/running_daemon.h"
#include "tests/support/simulated_recording.h"
#include "tools/bench/fleet/fleet_bench.h"
#include "tools/bench/stopwatch.h"
#include "tools/bench/subcommand.h"

namespace relmap::bench {

namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::built_program;
using testing::DaemonOptions;
using testing::RunningDaemon;

struct SecurityOptions {
  double seconds = 30;
  std::uint32_t robots = 20, rounds = 2;
  double forgeries_hz = 5000;
  std::uint32_t questions = 200;
  std::uint32_t strangers = 100'000;
  std::uint64_t seed = 1;
};

void run_or_throw(const std::vector<std::string>& command) {
  const testing::Finished done = testing::run_program(command, std::chrono::minutes(5));
  if (done.exit_code != 0) throw std::runtime_error(command[0] + ": " + done.standard_error);
}

// A folder of credentials, with one file for an operator and one for each of these robots.
std::string make_credentials(const std::string& folder, const std::vector<std::string>& robots) {
  run_or_throw({built_program("relmap-admin"), "credentials", "ca", folder});
  const auto issue = [&](const std::string& role, const std::string& name) {
    run_or_throw({built_program("relmap-admin"), "credentials", "new", folder, name, "--role", role, "--out",
                  folder + "/" + name + ".pem"});
  };
  issue("operator", "anna");
  for (const std::string& robot : robots) issue("robot", robot);
  return folder;
}

std::string picture(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

// Runs the fleet without seals and with them, in turn.
void price_of_seals(const SecurityOptions& options, Report& report) {
  std::vector<double> cpu, ack;
  for (std::uint32_t round = 0; round < options.rounds; ++round) {
    Report figures[2];
    for (const bool sealed : {false, true}) {
      FleetOptions fleet;
      fleet.robots = options.robots;
      fleet.seconds = options.seconds;
      fleet.seed = options.seed + round;
      fleet.sealed = sealed;
      run_fleet(fleet, figures[sealed]);
    }
    cpu.push_back(figures[1].value("cpu_ms_per_keyframe") / figures[0].value("cpu_ms_per_keyframe"));
    ack.push_back(figures[1].value("ack_p50_ms") / figures[0].value("ack_p50_ms"));
    if (figures[1].value("lost") != 0) throw std::runtime_error("keyframes were lost");
  }
  report.add("sealed_cpu_ratio", cpu, "the daemon's time per keyframe of a fleet over LCM, sealed and not");
  report.add("sealed_ack_p50_ratio", ack, "time until keyframes are acknowledged, sealed and not");
}

// The same fleet while forged and broken messages come in.
void cost_of_forgeries(const SecurityOptions& options, Report& report) {
  Report quiet, attacked;
  for (Report* figures : {&quiet, &attacked}) {
    FleetOptions fleet;
    fleet.robots = options.robots;
    fleet.seconds = options.seconds;
    fleet.seed = options.seed;
    fleet.sealed = true;
    fleet.garbage_hz = figures == &attacked ? options.forgeries_hz : 0;
    run_fleet(fleet, *figures);
  }
  report.add("forged_ack_p99_ratio", attacked.value("ack_p99_ms") / quiet.value("ack_p99_ms"),
             "time until keyframes are acknowledged, under forgeries and without");
  report.add("forged_lost", attacked.value("lost"), "keyframes of honest robots");
  report.add("forged_refused", attacked.value("refused") + attacked.value("given_up"), "likewise");
}

void price_of_tls(const SecurityOptions& options, const std::string& folder, Report& report) {
  const std::string drive =
      testing::record_simulation(folder + "/drive", {"--seed", "1", "--pairs", "60", "--laps", "0.5"});
  DaemonOptions served{.data = folder + "/tls", .lcm = "", .more = {}};
  served.credentials = make_credentials(folder + "/tls-credentials", {});
  RunningDaemon daemon(served);
  run_or_throw({built_program("relmap-frontend"), drive, "--robot", "cart", "--server", served.data, "--spool", "none",
                "--quiet"});
  const auto plain = client::Client::connect(served.data).or_throw();
  client::ClientOptions with;
  with.credentials = served.credentials + "/anna.pem";
  const auto tls = client::Client::connect(daemon.address(), with).or_throw();
  if (Status idle = plain->wait_idle(); !idle.ok()) throw StatusError(idle);
  client::View view;
  view.left = picture(drive + "/image_0/" + testing::picture_name(30));
  view.right = picture(drive + "/image_1/" + testing::picture_name(30));
  view.camera = SessionNumber{1};
  std::vector<double> localise[2], status[2];
  for (std::uint32_t i = 0; i < options.questions; ++i)
    for (const bool secured : {i % 2 == 0, i % 2 != 0}) {
      client::Client& asked = secured ? *tls : *plain;
      auto begin = Clock::now();
      (void)asked.localise(view);
      localise[secured].push_back(microseconds_since(begin));
      begin = Clock::now();
      if (!asked.status().ok()) throw std::runtime_error("no status");
      status[secured].push_back(microseconds_since(begin));
    }
  const auto ratio = [](const std::vector<double>(&us)[2], double share) {
    return quantile(us[1], share) / quantile(us[0], share);
  };
  report.add("tls_localise_p50_ratio", ratio(localise, 0.5), "Localise over TLS with certificates, and at the socket");
  report.add("tls_localise_p99_ratio", ratio(localise, 0.99), "");
  report.add("tls_status_p50_ratio", ratio(status, 0.5), "GetStatus, which does next to nothing else");
  daemon.stop();
}

// Many who take no answer, say nothing, send half a request, or wait until the daemon is idle, which it is not.
void crowd(const SecurityOptions& options, const std::string& folder, Report& report) {
  constexpr std::size_t kStalled = 1000, kIdle = 5000, kHalves = 100, kWaits = 16;
  const std::string drive = testing::record_simulation(folder + "/long", {"--seed", "2", "--pairs", "300"});
  DaemonOptions served{.data = folder + "/crowd", .lcm = "", .more = {"--backup-root", folder + "/backups"}};
  fs::create_directories(folder + "/backups");
  fs::permissions(folder + "/backups", fs::perms::owner_all);
  RunningDaemon daemon(served);
  testing::Process robot({built_program("relmap-frontend"), drive, "--robot", "cart", "--server", served.data,
                          "--spool", "none", "--quiet", "--live", "--rate", "10"},
                         testing::ProcessOptions{.standard_output = "", .standard_error = folder + "/robot.log"});
  const auto client = client::Client::connect(served.data).or_throw();
  const auto asked = [&] {
    std::vector<double> ms;
    for (std::uint32_t i = 0; i < options.questions; ++i) {
      const auto begin = Clock::now();
      if (const auto status = client->status(); !status.ok()) throw StatusError(status.status());
      ms.push_back(1e-3 * microseconds_since(begin));
      std::this_thread::sleep_for(milliseconds(10));
    }
    return ms;
  };
  const std::vector<double> quiet = asked();
  std::vector<testing::RawHttp2> crowd;
  const auto come = [&](std::size_t count, const auto& act) {
    for (std::size_t i = 0; i < count; ++i) {
      testing::RawHttp2 one(daemon.address());
      if (one.connected()) act(one);
      crowd.push_back(std::move(one));
    }
  };
  come(kStalled, [](testing::RawHttp2& one) {
    one.begin(0);
    one.call("/relmap.v1.Map/Export", std::string("\x08\x01", 2));
  });
  come(kHalves, [](testing::RawHttp2& one) {
    one.begin(65535);
    one.call("/relmap.v1.Map/GetStatus", std::string(100, 'x'), 50);
  });
  come(kIdle, [](testing::RawHttp2& one) { one.begin(65535); });
  std::vector<std::thread> waits;
  for (std::size_t i = 0; i < kWaits; ++i)
    waits.emplace_back([&] { (void)client::Client::connect(served.data).or_throw()->wait_idle(); });
  std::this_thread::sleep_for(seconds(1));
  const std::vector<double> crowded = asked();
  const auto begin = Clock::now();
  double started_s = -1;
  const auto backup = client->backup(folder + "/backups/now", [&](const client::Progress&) {
    if (started_s < 0) started_s = seconds_since(begin);
    return true;
  });
  if (!backup.ok()) throw StatusError(backup.status());
  report.add("crowd_status_p99_ms", quantile(crowded, 0.99),
             "GetStatus beside a crowd of callers that hold on to theirs");
  report.add("quiet_status_p99_ms", quantile(quiet, 0.99), "the same without them");
  report.add("crowd_backup_starts_s", std::max(0.0, started_s), "until a backup is under way beside them");
  robot.kill();
  crowd.clear();
  for (std::thread& wait : waits) wait.join();
  daemon.stop();
}

std::uint64_t bytes_in(const std::string& folder) {
  std::uint64_t sum = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file()) sum += entry.file_size();
  return sum;
}

// Sends the first keyframes of sessions without end: half of them without a seal, half with that of a robot of the
// fleet.
class Strangers {
 public:
  Strangers(const std::string& url, const access::RobotKey& key, std::uint32_t count)
      : link_(LcmLink::open(url, {{kMapChannel, [this](ByteSpan datagram) { meet(datagram); }}}).or_throw()),
        daemon_(key, 1) {
    thread_ = std::thread([this, count] { run(count); });
  }
  ~Strangers() { join(); }
  void join() {
    if (thread_.joinable()) thread_.join();
    link_->stop();
  }

 private:
  void meet(ByteSpan datagram) {
    const MutexLock lock(mutex_);
    const auto opened = daemon_.open(kMapChannel, datagram);
    const auto map = opened ? decode_lcm_map(opened->message) : Result<DaemonIdentity>(Reason::CORRUPT, "");
    if (map.ok() && daemon_.heard(map->boot, opened->seal, Clock::now())) (void)daemon_.welcome(*map, Clock::now());
  }

  void run(std::uint32_t count) {
    Keyframe keyframe = sample_keyframe();
    keyframe.session.robot = "mallory";
    keyframe.sequence = 0;
    keyframe.tracks.clear();
    for (std::uint32_t i = 0; i < count; ++i) {
      keyframe.session.uuid = SessionUuid::random();
      const Bytes payload = encode_keyframe(keyframe);
      Bytes message = encode_lcm(cut_part(keyframe.session.uuid, 0, payload, crc32c(payload), kMaxPartBytes, 0));
      {
        const MutexLock lock(mutex_);
        if (i % 1000 == 0) {
          Bytes hello = encode_lcm(Hello{keyframe.session.uuid});
          daemon_.seal_hello(hello);
          link_->publish(kHelloChannel, hello);
        }
        if (i % 2 == 0 && daemon_.ready(Clock::now())) daemon_.seal(kKeyframeChannel, message);
      }
      link_->publish(kKeyframeChannel, message);
      if (i % 100 == 99) std::this_thread::sleep_for(milliseconds(5));
    }
  }

  Mutex mutex_;
  std::unique_ptr<LcmLink> link_;
  publishing::SealedDaemon daemon_ RELMAP_GUARDED_BY(mutex_);
  std::thread thread_;
};

void strangers(const SecurityOptions& options, const std::string& folder, Report& report) {
  DaemonOptions served{.data = folder + "/strangers", .lcm = testing::random_lcm_url(), .more = {}};
  served.credentials = make_credentials(folder + "/fleet", {"cart", "mallory"});
  const auto key = [&](const std::string& robot) {
    return access::read_credentials(served.credentials + "/" + robot + ".pem").or_throw().robot_key.value();
  };
  auto daemon = std::make_unique<RunningDaemon>(served);
  int begun = 0;
  // Seconds until the first keyframe of a new session of an honest robot is settled.
  const auto begin_session = [&] {
    publishing::PublisherOptions publisher;
    publisher.spool = folder + "/spool-" + std::to_string(++begun);
    SessionHeader header = sample_keyframe().session;
    header.uuid = {};
    header.robot = "cart";
    header.name = "session " + std::to_string(begun);
    auto transport = publishing::LcmTransport::open(served.lcm, {key("cart")}).or_throw();
    const auto begin = Clock::now();
    const auto robot = publishing::Publisher::start(publisher, header, std::move(transport)).or_throw();
    Keyframe keyframe = sample_keyframe();
    keyframe.session = robot->session();
    keyframe.sequence = 0;
    keyframe.tracks.clear();
    if (Status pushed = robot->push(keyframe); !pushed.ok()) throw StatusError(pushed);
    if (!robot->finish(Clock::now() + seconds(60)).all_settled())
      throw std::runtime_error("an honest robot's session does not begin");
    return seconds_since(begin);
  };
  (void)begin_session();
  const double resident = daemon->client()->status().or_throw().resident_bytes;
  const std::uint64_t disk = bytes_in(served.data);
  std::vector<double> meanwhile;
  {
    Strangers crowd(served.lcm, key("mallory"), options.strangers);
    for (int i = 0; i < 5; ++i) {
      meanwhile.push_back(begin_session());
      std::this_thread::sleep_for(seconds(1));
    }
    crowd.join();
  }
  if (Status idle = daemon->client()->wait_idle(); !idle.ok()) throw StatusError(idle);
  const auto status = daemon->client()->status().or_throw();
  report.add("strangers_begin_max_s", *std::max_element(meanwhile.begin(), meanwhile.end()),
             "until an honest robot's new session is settled, beside the sessions of strangers");
  report.add("strangers_sessions", status.sessions, "in the map afterwards, with those of the honest robot");
  report.add("strangers_resident_ratio", static_cast<double>(status.resident_bytes) / resident, "after and before");
  report.add("strangers_disk_mb", static_cast<double>(bytes_in(served.data) - disk) / (1 << 20), "more than before");
  daemon->stop();
  daemon = std::make_unique<RunningDaemon>(served);
  report.add("strangers_begin_after_restart_s", begin_session(), "the same after a restart");
  daemon->stop();
}

void run(const SecurityOptions& options, Report& report) {
  if (!testing::enter_private_network(testing::Multicast::kOnLoopback))
    std::cerr << "no network namespace may be made here: random multicast groups of this machine instead\n";
  const storage::TemporaryFolder folder;
  for (const char* part : {"tls", "crowd", "strangers"}) fs::create_directories(folder / part);
  if (options.seconds > 0) {
    price_of_seals(options, report);
    cost_of_forgeries(options, report);
  }
  price_of_tls(options, folder / "tls", report);
  crowd(options, folder / "crowd", report);
  strangers(options, folder / "strangers", report);
}

}  // namespace

Run declare_security(CLI::App& app) {
  auto options = std::make_shared<SecurityOptions>();
  app.footer(
      "Examples:\n"
      "  relmap-bench security --json\n"
      "  relmap-bench security --seconds 0 --strangers 10000    without the fleets");
  app.add_option("--seconds", options->seconds, "of each fleet; 0: no fleets")->capture_default_str();
  app.add_option("--robots", options->robots, "of each fleet")->capture_default_str();
  app.add_option("--rounds", options->rounds, "pairs of fleets, without seals and with them")->capture_default_str();
  app.add_option("--forgeries", options->forgeries_hz, "forged messages a second")->capture_default_str();
  app.add_option("--questions", options->questions, "of each kind")->capture_default_str();
  app.add_option("--strangers", options->strangers, "sessions that strangers try to begin")->capture_default_str();
  app.add_option("--seed", options->seed, "seed of the fleets")->capture_default_str();
  return [options](Report& report) { run(*options, report); };
}

}  // namespace relmap::bench
