// relmap-bench ingest: keyframes with pictures, ready made, through a daemon of its own until all are looked up.
#include <algorithm>
#include <atomic>
#include <fstream>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "frontend/capture/keyframe_file.h"
#include "storage/map/map.h"
#include "storage/rocksdb/rocksdb_engine.h"
#include "storage/testing/temporary_folder.h"
#include "tests/support/drive_evaluation.h"
#include "tests/support/running_daemon.h"
#include "tools/bench/fleet/batch.h"
#include "tools/bench/stopwatch.h"
#include "tools/bench/subcommand.h"

namespace relmap::bench {

namespace {

using Keyframes = std::vector<Keyframe>;

struct IngestOptions {
  std::string pictures, truth, relmapd;
  std::uint32_t sessions = 1;
  std::optional<std::uint32_t> lookup_threads;
  std::size_t memory_budget_mb = 512;
};

Keyframes read(const std::string& path) {
  auto file = capture::KeyframeFileReader::open(path).or_throw();
  Keyframes keyframes;
  for (auto next = file.next().or_throw(); next; next = file.next().or_throw()) keyframes.push_back(std::move(*next));
  if (keyframes.empty()) throw StatusError(Status(Reason::BAD_SIZE, path + " holds no keyframe"));
  return keyframes;
}

// The recording as robot `number` sends it. The first is the recording itself.
Keyframes as_sent_by(std::uint32_t number, Keyframes keyframes) {
  if (number == 0) return keyframes;
  SessionHeader session = keyframes.front().session;
  session.robot += " " + std::to_string(number + 1);
  session.uuid.bytes[0] ^= static_cast<std::uint8_t>(number);
  session.uuid.bytes[1] ^= static_cast<std::uint8_t>(number >> 8);
  for (Keyframe& keyframe : keyframes) keyframe.session = session;
  return keyframes;
}

// Asks a daemon, again and again until it is destroyed, how far its lookups are behind.
class LagWatch {
 public:
  explicit LagWatch(std::unique_ptr<client::Client> client)
      : client_(std::move(client)), thread_([this] { watch(); }) {}
  ~LagWatch() { end(); }

  // Seconds, at most. Ends the watch.
  double max_lag_s() {
    end();
    return max_s_;
  }

 private:
  void end() {
    done_ = true;
    if (thread_.joinable()) thread_.join();
  }
  void watch() {
    for (; !done_; std::this_thread::sleep_for(std::chrono::milliseconds(20))) {
      if (const auto status = client_->status(); status.ok()) max_s_ = std::max(max_s_, status->lookup_lag_s);
    }
  }

  const std::unique_ptr<client::Client> client_;
  std::atomic<bool> done_ = false;
  double max_s_ = 0;  // of the thread until it has ended
  std::thread thread_;
};

void publish_at_once(const std::string& server, const std::vector<Keyframes>& sessions) {
  std::vector<std::exception_ptr> failures(sessions.size());
  {
    std::vector<std::jthread> robots;
    for (std::size_t i = 0; i < sessions.size(); ++i)
      robots.emplace_back([&, i] {
        try {
          publish(server, sessions[i].front().session, sessions[i]);
        } catch (...) {
          failures[i] = std::current_exception();
        }
      });
  }
  for (const std::exception_ptr& failure : failures)
    if (failure) std::rethrow_exception(failure);
}

testing::EdgesJudged judge(const std::string& folder, const std::string& truth) {
  const auto engine = storage::open_rocksdb(folder, {}).or_throw();
  const std::uint64_t epoch = engine->acquire().or_throw();
  const auto map =
      storage::Map::open(engine, epoch, std::make_shared<storage::Budget>(std::size_t{1} << 30)).or_throw();
  return testing::judge_edges(*map->publish(), testing::read_truth(truth).or_throw());
}

void run(const IngestOptions& options, Report& report) {
  const Keyframes recording = read(options.pictures);
  std::vector<Keyframes> sessions;
  for (std::uint32_t i = 0; i < options.sessions; ++i) sessions.push_back(as_sent_by(i, recording));

  const storage::TemporaryFolder folder;
  testing::DaemonOptions how{.data = folder / "map",
                             .lcm = {},
                             .memory_budget_mb = options.memory_budget_mb,
                             .more = {},
                             .program = options.relmapd};
  if (options.lookup_threads) {
    how.more = {"--config", folder / "config.yaml"};
    std::ofstream(how.more.back()) << "lookup_threads: " << *options.lookup_threads << '\n';
  }
  testing::RunningDaemon daemon(how);
  client::ClientOptions patient;
  patient.deadline = std::chrono::minutes(60);
  const auto client = client::Client::connect(daemon.address(), patient).or_throw();

  LagWatch lag(daemon.client());
  const auto begin = Clock::now();
  const double cpu_before = daemon.process().cpu_seconds();
  publish_at_once(how.data, sessions);
  const double durable_s = seconds_since(begin);
  if (const Status idle = client->wait_idle(); !idle.ok()) throw StatusError(idle);
  const double s = seconds_since(begin), cpu_s = daemon.process().cpu_seconds() - cpu_before;
  const double max_lag_s = lag.max_lag_s();
  const client::DaemonStatus status = client->status().or_throw();
  const auto keyframes = static_cast<double>(recording.size() * sessions.size());
  if (static_cast<double>(status.frames) != keyframes) throw std::runtime_error("keyframes were lost");
  const double resident = static_cast<double>(daemon.process().peak_resident_bytes());
  if (daemon.stop() != 0) throw std::runtime_error("relmapd did not stop as it should: " + daemon.log());

  report.add("keyframes", keyframes, "of all sessions");
  report.add("keyframes_per_s", keyframes / s, "from the first push until all are relaxed and looked up");
  report.add("durable_per_s", keyframes / durable_s, "until all are acknowledged");
  report.add("cpu_ms_per_keyframe", 1e3 * cpu_s / keyframes, "of the daemon");
  report.add("lookup_lag_max_s", max_lag_s, "a keyframe was in the map before its lookup was done, at most");
  report.add("closures", static_cast<double>(status.closures_accepted), "in force at the end");
  report.add("resident_mb", resident / (1 << 20), "of the daemon, at most");
  if (options.truth.empty()) return;
  const testing::EdgesJudged judged = judge(how.data, options.truth);
  report.add("right", judged.right, "closures in force within 0.5 m and 10 degrees of the truth");
  report.add("wrong", judged.wrong, "closures in force beyond that");
  report.add("worst_step_m", judged.worst_step_m, "the greatest error of a robot's step from keyframe to keyframe");
}

}  // namespace

Run declare_ingest(CLI::App& app) {
  const auto options = std::make_shared<IngestOptions>();
  app.add_option("--pictures", options->pictures, "keyframes of one session, as relmap-frontend --out writes them")
      ->required();
  app.add_option("--truth", options->truth,
                 "folder with poses.txt and times.txt of the recording; judges closures and steps");
  app.add_option("--sessions", options->sessions, "robots that send the same recording at the same time")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  app.add_option("--lookup-threads", options->lookup_threads, "of the daemon (default: its own)");
  app.add_option("--memory-budget-mb", options->memory_budget_mb, "of the daemon")->capture_default_str();
  app.add_option("--relmapd", options->relmapd, "the program; default: that of this build");
  app.footer(
      "Example:\n"
      "  relmap-sim pictures --out drive --pairs 900 --laps 2\n"
      "  relmap-frontend --source sim drive --robot r --out drive.bin\n"
      "  relmap-bench ingest --pictures drive.bin --truth drive --json");
  return [options](Report& report) { run(*options, report); };
}

}  // namespace relmap::bench
