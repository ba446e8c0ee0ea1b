// What security costs, and what those who mean harm can do to others: seals over LCM, TLS, forgeries, crowds of callers
// and strangers' sessions. Figures of one run are ratios against the same without, or times that others have to wait.
#include <algorithm>
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
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
#include "server/ops/process.h"
#include "storage/memory/budget.h"
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

// Keyframes a second of each robot. Twenty robots that see the same circuit take more than two cores at five.
constexpr double kRate = 2;

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

FleetOptions fleet_of(const SecurityOptions& options, std::uint32_t round) {
  FleetOptions fleet;
  fleet.robots = options.robots;
  fleet.seconds = options.seconds;
  fleet.rate = kRate;
  fleet.seed = options.seed + round;
  return fleet;
}

// Runs the fleet without seals and with them, in turn.
void price_of_seals(const SecurityOptions& options, Report& report) {
  std::vector<double> cpu, ack;
  for (std::uint32_t round = 0; round < options.rounds; ++round) {
    Report figures[2];
    for (const bool sealed : {false, true}) {
      FleetOptions fleet = fleet_of(options, round);
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

// The same fleet while somebody forges what its robots and the daemon say: one of the fleet, so that what it seals is
// not refused for its key alone.
void cost_of_forgeries(const SecurityOptions& options, Report& report) {
  std::vector<double> ratios;
  double lost = 0, refused = 0, forged = 0, turned_away = 0;
  for (std::uint32_t round = 0; round < options.rounds; ++round) {
    Report quiet, attacked;
    for (Report* figures : {&quiet, &attacked}) {
      FleetOptions fleet = fleet_of(options, round);
      fleet.sealed = true;
      fleet.forgeries_hz = figures == &attacked ? options.forgeries_hz : 0;
      run_fleet(fleet, *figures);
    }
    ratios.push_back(attacked.value("ack_p99_ms") / quiet.value("ack_p99_ms"));
    lost += attacked.value("lost");
    refused += attacked.value("refused") + attacked.value("given_up");
    forged += attacked.value("forgeries_sent");
    turned_away += attacked.value("forgeries_refused");
  }
  report.add("forged_ack_p99_ratio", ratios, "time until keyframes are acknowledged, under forgeries and without");
  report.add("forged_lost", lost, "keyframes of honest robots");
  report.add("forged_refused", refused, "likewise");
  report.add("forgeries_sent", forged, "gaps, ends, keyframes, acknowledgements, news, hellos and repetitions");
  report.add("forgeries_refused", turned_away, "by the daemon; what is in its name it does not hear");
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

// What callers get while a crowd is there.
struct Answers {
  std::vector<double> ms;
  double failed = 0;           // for want of room, or since the connection was cut
  double waiting = 0;          // median
  double backup_starts_s = 0;  // until a backup was under way
};

// Callers of one kind, each with a connection of its own, from several addresses.
class Crowd {
 public:
  Crowd(const std::string& daemon, std::size_t count, int first_address, int addresses,
        const std::function<void(testing::RawHttp2&)>& act) {
    for (std::size_t i = 0; i < count; ++i) {
      const int address = first_address + static_cast<int>(i) % addresses;
      testing::RawHttp2 one(daemon, "127.0.0." + std::to_string(address));
      if (one.connected()) act(one);
      all_.push_back(std::move(one));
    }
  }
  double open() {
    return static_cast<double>(std::count_if(all_.begin(), all_.end(), [](auto& one) { return !one.closed(); }));
  }

 private:
  std::vector<testing::RawHttp2> all_;
};

// Calls WaitIdle again and again, so that so many wait at once.
class Waits {
 public:
  Waits(const std::string& daemon, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i)
      threads_.emplace_back([this, daemon] {
        const auto client = client::Client::connect(daemon).or_throw();
        for (; !stopping_; std::this_thread::sleep_for(milliseconds(50))) {
          ++waiting_;
          (void)client->wait_idle();
          --waiting_;
        }
      });
  }
  ~Waits() {
    stopping_ = true;
    for (std::thread& thread : threads_) thread.join();
  }
  double waiting() const { return waiting_; }

 private:
  std::atomic<bool> stopping_ = false;
  std::atomic<int> waiting_ = 0;
  std::vector<std::thread> threads_;
};

// A daemon that lets all of them in: who is refused at the door costs nobody anything.
class CrowdedDaemon {
 public:
  CrowdedDaemon(const SecurityOptions& options, const std::string& folder)
      : options_(options), folder_(folder), daemon_(served(folder)) {
    testing::record_simulation(folder + "/long", {"--seed", "2", "--pairs", "300"});
    robot_ = std::make_unique<testing::Process>(
        std::vector<std::string>{built_program("relmap-frontend"), folder + "/long", "--robot", "cart", "--server",
                                 data(), "--spool", "none", "--quiet", "--live", "--rate", "4"},
        testing::ProcessOptions{.standard_output = "", .standard_error = folder + "/robot.log"});
    here_ = client::Client::connect(data()).or_throw();
    over_tcp_ = client::Client::connect(daemon_.address()).or_throw();
  }
  ~CrowdedDaemon() {
    robot_->kill();
    daemon_.stop();
  }

  std::string data() const { return folder_ + "/crowd"; }
  std::string address() const { return daemon_.address(); }

  // From now on there is always something to do.
  std::unique_ptr<testing::Process> keep_busy() const {
    run_or_throw({built_program("relmap-sim"), "points", "--out", folder_ + "/points", "--frames", "5000",
                  "--frames-per-lap", "300", "--appearance", "100"});
    return std::make_unique<testing::Process>(
        std::vector<std::string>{built_program("relmap"), "--server", data(), "ingest", folder_ + "/points"},
        testing::ProcessOptions{.standard_output = "", .standard_error = folder_ + "/ingest.log"});
  }

  // Asks for the status at the socket and over TCP, in turn, and begins a backup, again and again until it is under
  // way. `waiting`: how many wait just now.
  Answers ask(const std::function<double()>& waiting = {}) {
    std::this_thread::sleep_for(seconds(1));
    Answers answers;
    std::vector<double> waits;
    for (std::uint32_t i = 0; i < options_.questions; ++i) {
      const auto begin = Clock::now();
      const auto status = (i % 2 == 0 ? here_ : over_tcp_)->status();
      answers.ms.push_back(1e-3 * microseconds_since(begin));
      if (!status.ok()) std::cerr << "GetStatus: " << status.status().to_string() << '\n';
      answers.failed += status.ok() ? 0 : 1;
      if (waiting) waits.push_back(waiting());
      std::this_thread::sleep_for(milliseconds(10));
    }
    if (waiting) answers.waiting = quantile(waits, 0.5);
    answers.backup_starts_s = backup();
    return answers;
  }

 private:
  // Seconds until a backup is under way, which is asked for again while there is no room for it.
  double backup() {
    const std::string folder = folder_ + "/backups/" + std::to_string(++backups_);
    const auto begin = Clock::now();
    double started_s = -1;
    for (;; std::this_thread::sleep_for(milliseconds(200))) {
      const auto made = here_->backup(folder, [&](const client::Progress&) {
        if (started_s < 0) started_s = seconds_since(begin);
        return true;
      });
      if (made.ok()) return std::max(0.0, started_s);
      std::cerr << "Backup: " << made.status().to_string() << '\n';
      if (seconds_since(begin) > 120) throw StatusError(made.status());
    }
  }

  static DaemonOptions served(const std::string& folder) {
    const std::string backups = folder + "/backups";
    fs::create_directories(backups);
    fs::permissions(backups, fs::perms::owner_all);
    std::ofstream(folder + "/relmapd.yaml") << "rpc: {max_connections: 8192, max_connections_per_peer: 1024}\n";
    return {
        .data = folder + "/crowd", .lcm = "", .more = {"--backup-root", backups, "--config", folder + "/relmapd.yaml"}};
  }

  const SecurityOptions& options_;
  const std::string folder_;
  RunningDaemon daemon_;
  std::unique_ptr<testing::Process> robot_;
  std::unique_ptr<client::Client> here_, over_tcp_;
  int backups_ = 0;
};

// Many who take no answer, say nothing, send half a request, or wait until the daemon is idle, which it is not: each
// kind alone, and all at once.
void crowd(const SecurityOptions& options, const std::string& folder, Report& report) {
  constexpr std::size_t kStalled = 1000, kIdle = 5000, kHalves = 100, kWaits = 16;
  constexpr int kFirst = 2;  // ours come from 127.0.0.1
  ops::raise_file_limit();
  CrowdedDaemon daemon(options, folder);
  const auto stalled = [&](int addresses) {
    return Crowd(daemon.address(), kStalled, kFirst, addresses, [](testing::RawHttp2& one) {
      one.begin(0);
      one.call("/relmap.v1.Map/Export", std::string("\x08\x01", 2));
    });
  };
  const auto halves = [&] {
    return Crowd(daemon.address(), kHalves, kFirst + 10, 1, [](testing::RawHttp2& one) {
      one.begin(65535);
      one.call("/relmap.v1.Map/GetStatus", std::string(100, 'x'), 50);
    });
  };
  const auto idle = [&] {
    return Crowd(daemon.address(), kIdle, kFirst + 20, 10, [](testing::RawHttp2& one) { one.begin(65535); });
  };
  const auto tell = [&](const std::string& who, const Answers& answers, const std::string& meaning) {
    std::cerr << "asked beside " << meaning << '\n';
    report.add(who + "_status_p99_ms", quantile(answers.ms, 0.99), "GetStatus beside " + meaning);
    report.add(who + "_status_failed", answers.failed, "of these questions: refused for want of room, or cut off");
    report.add(who + "_backup_starts_s", answers.backup_starts_s, "until a backup is under way");
  };
  const auto measured = [&](const std::string& who, auto crowd, const std::string& meaning) {
    report.add(who + "_came", crowd.open(), "connections that are there before anything is asked");
    const Answers answers = daemon.ask();
    report.add(who + "_open", crowd.open(), "so many are still there afterwards");
    tell(who, answers, meaning);
  };
  tell("quiet", daemon.ask(), "nobody");
  measured("stalled", stalled(1), "1,000 calls of one caller who takes no answer");
  measured("stalled_4_callers", stalled(4), "the same of four callers");
  measured("halves", halves(), "100 requests that do not finish arriving");
  measured("idle", idle(), "5,000 idle connections");
  const auto busy = daemon.keep_busy();
  const Waits waits(daemon.data(), kWaits);
  const auto waiting = [&] { return waits.waiting(); };
  const Answers beside_waits = daemon.ask(waiting);
  report.add("waits_open", beside_waits.waiting, "so many wait at once");
  tell("waits", beside_waits, "16 calls of WaitIdle, while keyframes come in as fast as they are taken");
  Crowd all[] = {stalled(1), halves(), idle()};
  const Answers beside_all = daemon.ask(waiting);
  double open = beside_all.waiting;
  for (Crowd& one : all) open += one.open();
  report.add("crowd_open", open, "so many of all are still there afterwards");
  tell("crowd", beside_all, "all of these but the four");
}

// Sends the first keyframes of sessions without end, sealed with the key of a robot of the fleet.
class Strangers {
 public:
  Strangers(const std::string& url, const access::RobotKey& key)
      : link_(LcmLink::open(url, {{kMapChannel, [this](ByteSpan datagram) { meet(datagram); }}}).or_throw()),
        daemon_(key, 1) {
    thread_ = std::thread([this] { run(); });
  }
  ~Strangers() {
    stopping_ = true;
    thread_.join();
    link_->stop();
  }
  std::uint64_t sent() const { return sent_; }

 private:
  void meet(ByteSpan datagram) {
    const MutexLock lock(mutex_);
    const auto opened = daemon_.open(kMapChannel, datagram);
    const auto map = opened ? decode_lcm_map(opened->message) : Result<DaemonIdentity>(Reason::CORRUPT, "");
    if (map.ok() && daemon_.heard(map->boot, opened->seal, Clock::now())) (void)daemon_.welcome(*map, Clock::now());
  }

  void run() {
    constexpr int kAtOnce = 100;
    Keyframe keyframe = sample_keyframe();
    keyframe.session.robot = "mallory";
    keyframe.sequence = 0;
    keyframe.tracks.clear();
    keyframe.appearance.clear();
    for (; !stopping_; std::this_thread::sleep_for(milliseconds(20))) {
      if (!ready()) continue;
      for (int i = 0; i < kAtOnce; ++i, ++sent_) {
        keyframe.session.uuid = SessionUuid::random();
        const Bytes payload = encode_keyframe(keyframe);
        Bytes message = encode_lcm(cut_part(keyframe.session.uuid, 0, payload, crc32c(payload), kMaxPartBytes, 0));
        {
          const MutexLock lock(mutex_);
          daemon_.seal(kKeyframeChannel, message);
        }
        link_->publish(kKeyframeChannel, message);
      }
    }
  }

  // Says hello while the daemon does not take what is sealed.
  bool ready() {
    Bytes hello = encode_lcm(Hello{SessionUuid::random()});
    const MutexLock lock(mutex_);
    if (daemon_.wants_hello(Clock::now())) {
      daemon_.seal_hello(hello);
      link_->publish(kHelloChannel, hello);
    }
    return daemon_.ready(Clock::now());
  }

  Mutex mutex_;
  std::unique_ptr<LcmLink> link_;
  publishing::SealedDaemon daemon_ RELMAP_GUARDED_BY(mutex_);
  std::atomic<bool> stopping_ = false;
  std::atomic<std::uint64_t> sent_ = 0;
  std::thread thread_;
};

// A daemon with an honest robot, whose sessions begin beside those of a robot that begins them without end.
class StrangersDaemon {
 public:
  StrangersDaemon(const std::string& folder, const std::string& settings) : folder_(folder) {
    fs::create_directories(folder);
    std::ofstream(folder + "/relmapd.yaml") << settings;
    options_ = {.data = folder + "/map",
                .lcm = testing::random_lcm_url(),
                .memory_budget_mb = 1024,
                .more = {"--config", folder + "/relmapd.yaml"}};
    options_.credentials = make_credentials(folder + "/fleet", {"cart", "mallory"});
    start();
  }
  ~StrangersDaemon() { daemon_->stop(); }

  void start() { daemon_ = std::make_unique<RunningDaemon>(options_); }
  void restart() {
    daemon_->stop();
    start();
  }
  client::DaemonStatus status() const { return daemon_->client()->status().or_throw(); }
  double resident_mb() const { return static_cast<double>(status().resident_bytes) / (1 << 20); }
  // What the budget counts but for caches, which fill with whatever is read and give way by themselves.
  double used_mb() const {
    std::uint64_t sum = 0;
    for (const client::MemoryShare& share : status().memory_shares)
      if (share.name != storage::share_name(storage::Share::kCache) &&
          share.name != storage::share_name(storage::Share::kEngine) &&
          share.name != storage::share_name(storage::Share::kAllocator) &&
          share.name != storage::share_name(storage::Share::kPictures))
        sum += share.used;
    return static_cast<double>(sum) / (1 << 20);
  }
  double disk_mb() const {
    std::uint64_t sum = 0;
    for (const auto& entry : fs::recursive_directory_iterator(options_.data))
      if (entry.is_regular_file()) sum += entry.file_size();
    return static_cast<double>(sum) / (1 << 20);
  }
  std::unique_ptr<client::Client> client() const {
    client::ClientOptions patient;
    patient.deadline = std::chrono::hours(1);
    return client::Client::connect(options_.data, patient).or_throw();
  }
  void wait_idle() const {
    if (Status idle = client()->wait_idle(); !idle.ok()) throw StatusError(idle);
  }
  const std::string& lcm() const { return options_.lcm; }
  access::RobotKey key(const std::string& robot) const {
    return access::read_credentials(options_.credentials + "/" + robot + ".pem").or_throw().robot_key.value();
  }

  // Seconds until the first keyframe of a new session of the honest robot is settled.
  double begin_session() {
    publishing::PublisherOptions publisher;
    publisher.spool = folder_ + "/spool-" + std::to_string(++begun_);
    SessionHeader header = sample_keyframe().session;
    header.uuid = {};
    header.robot = "cart";
    header.name = "session " + std::to_string(begun_);
    auto transport = publishing::LcmTransport::open(options_.lcm, {key("cart")}).or_throw();
    const auto begin = Clock::now();
    const auto robot = publishing::Publisher::start(publisher, header, std::move(transport)).or_throw();
    Keyframe keyframe = sample_keyframe();
    keyframe.session = robot->session();
    keyframe.sequence = 0;
    keyframe.tracks.clear();
    keyframe.appearance.clear();
    if (Status pushed = robot->push(keyframe); !pushed.ok()) throw StatusError(pushed);
    const publishing::PublishSummary summary = robot->finish(Clock::now() + seconds(60));
    if (!summary.all_settled() || !summary.refused.empty())
      throw std::runtime_error("an honest robot's session does not begin");
    return seconds_since(begin);
  }

  // As an operator does who wants the robot's sessions to be gone.
  void delete_sessions_of(const std::string& robot) const {
    constexpr std::size_t kAtOnce = 16;
    const auto sessions = client()->sessions().or_throw();
    std::atomic<std::size_t> next = 0;
    std::atomic<std::size_t> failed = 0;
    std::vector<std::thread> threads;
    for (std::size_t t = 0; t < kAtOnce; ++t)
      threads.emplace_back([&] {
        const auto deleting = client();
        for (std::size_t i; (i = next++) < sessions.size();)
          if (sessions[i].robot == robot &&
              !deleting
                   ->delete_session(sessions[i].number, sessions[i].uuid, [](const client::Progress&) { return true; })
                   .ok())
            ++failed;
      });
    for (std::thread& thread : threads) thread.join();
    if (failed > 0) throw std::runtime_error(std::to_string(failed) + " sessions were not deleted");
  }

 private:
  const std::string folder_;
  DaemonOptions options_;
  std::unique_ptr<RunningDaemon> daemon_;
  int begun_ = 0;
};

// How many sessions a robot gets in that begins them without end, as relmapd is configured by default.
void limited_strangers(const SecurityOptions& options, const std::string& folder, Report& report) {
  StrangersDaemon daemon(folder, "");
  const std::uint32_t before = daemon.status().sessions;
  std::uint64_t tried = 0;
  double longest = 0;
  {
    Strangers crowd(daemon.lcm(), daemon.key("mallory"));
    while ((tried = crowd.sent()) < options.strangers) {
      longest = std::max(longest, daemon.begin_session());
      std::this_thread::sleep_for(seconds(1));
    }
  }
  report.add("limited_begin_s", longest, "a new session of an honest robot meanwhile, at most");
  report.add("limited_tried", static_cast<double>(tried), "sessions that a robot tries to begin");
  report.add("limited_sessions", daemon.status().sessions - before,
             "of these, in the map, with those of the honest one");
}

// The same without a limit, so that all of them are there, and what is left of them after they were deleted.
void strangers(const SecurityOptions& options, const std::string& folder, Report& report) {
  StrangersDaemon daemon(folder, "ingest: {max_new_sessions_per_min: 0}\n");
  (void)daemon.begin_session();
  daemon.wait_idle();
  const double resident = daemon.resident_mb(), used = daemon.used_mb(), disk = daemon.disk_mb();
  std::vector<double> meanwhile;
  {
    const Strangers crowd(daemon.lcm(), daemon.key("mallory"));
    while (daemon.status().sessions < options.strangers) {
      meanwhile.push_back(daemon.begin_session());
      std::this_thread::sleep_for(seconds(1));
    }
  }
  daemon.wait_idle();
  report.add("strangers_begin_p50_s", quantile(meanwhile, 0.5),
             "until an honest robot's new session is settled, beside the sessions of strangers");
  report.add("strangers_begin_max_s", *std::max_element(meanwhile.begin(), meanwhile.end()), "the longest");
  report.add("strangers_sessions", daemon.status().sessions, "in the map afterwards, with those of the honest robot");
  report.add("strangers_resident_before_mb", resident, "of the daemon, before they came");
  report.add("strangers_resident_top_mb", daemon.resident_mb(), "with all of them");
  report.add("strangers_used_before_mb", used, "of the memory budget, without caches, before they came");
  report.add("strangers_used_top_mb", daemon.used_mb(), "with all of them");
  report.add("strangers_disk_top_mb", daemon.disk_mb() - disk, "more than before");
  const auto begin_again = Clock::now();
  daemon.restart();
  report.add("strangers_restart_s", seconds_since(begin_again), "to stop and to serve again");
  report.add("strangers_begin_after_restart_s", daemon.begin_session(), "an honest session after a restart");
  const auto begin = Clock::now();
  daemon.delete_sessions_of("mallory");
  report.add("strangers_delete_s", seconds_since(begin), "to delete their sessions, sixteen at a time");
  daemon.wait_idle();
  if (const auto done = daemon.client()->compact([](const client::Progress&) { return true; }); !done.ok())
    throw StatusError(done.status());
  report.add("strangers_resident_after_mb", daemon.resident_mb(), "once they are deleted and the store is compacted");
  report.add("strangers_used_after_mb", daemon.used_mb(), "likewise; a tombstone of each stays");
  report.add("strangers_resident_ratio", daemon.resident_mb() / resident, "of this to that before they came");
  report.add("strangers_disk_mb", daemon.disk_mb() - disk, "more than before; the journal's is free within a day");
  report.add("strangers_sessions_left", daemon.status().sessions, "those of the honest robot");
  daemon.restart();
  report.add("strangers_resident_restarted_mb", daemon.resident_mb(), "after one more restart");
  report.add("strangers_begin_after_deletion_s", daemon.begin_session(), "an honest session then");
}

void run(const SecurityOptions& options, Report& report) {
  if (!testing::enter_private_network(testing::Multicast::kOnLoopback))
    std::cerr << "no network namespace may be made here: random multicast groups of this machine instead\n";
  const storage::TemporaryFolder folder;
  for (const char* part : {"tls", "crowd"}) fs::create_directories(folder / part);
  if (options.seconds > 0) {
    price_of_seals(options, report);
    cost_of_forgeries(options, report);
  }
  if (options.questions > 0) {
    price_of_tls(options, folder / "tls", report);
    crowd(options, folder / "crowd", report);
  }
  if (options.strangers > 0) {
    limited_strangers(options, folder / "limited", report);
    strangers(options, folder / "strangers", report);
  }
}

}  // namespace

Run declare_security(CLI::App& app) {
  auto options = std::make_shared<SecurityOptions>();
  app.footer(
      "Examples:\n"
      "  relmap-bench security --json\n"
      "  relmap-bench security --seconds 0 --strangers 10000   # without the fleets\n"
      "  relmap-bench security --seconds 0 --strangers 0   # only TLS and crowds");
  app.add_option("--seconds", options->seconds, "of each fleet; 0: no fleets")->capture_default_str();
  app.add_option("--robots", options->robots, "of each fleet")->capture_default_str();
  app.add_option("--rounds", options->rounds, "pairs of fleets, without seals and with them")->capture_default_str();
  app.add_option("--forgeries", options->forgeries_hz, "forged messages a second")->capture_default_str();
  app.add_option("--questions", options->questions, "of each kind; 0: neither TLS nor crowds")->capture_default_str();
  app.add_option("--strangers", options->strangers, "sessions that strangers begin; 0: none")->capture_default_str();
  app.add_option("--seed", options->seed, "seed of the fleets")->capture_default_str();
  return [options](Report& report) { run(*options, report); };
}

}  // namespace relmap::bench
