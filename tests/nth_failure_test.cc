// The n-th open, write, sync or allocation of relmapd fails or hangs, while a robot sends a drive, an operator labels a
// frame and has the map committed, and readers ask. Readers are answered meanwhile; the daemon goes on, or ends with a
// reason; the next start has everything that was acknowledged.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cerrno>
#include <filesystem>
#include <future>
#include <regex>
#include <thread>

#include "proto/base/crc32c.h"
#include "storage/maintenance/verify.h"
#include "storage/rocksdb/rocksdb_engine.h"
#include "storage/testing/temporary_folder.h"
#include "tests/file_faults/traced_program.h"
#include "tests/support/hand_robot.h"
#include "tests/support/running_daemon.h"
#include "tests/support/stored_map.h"
#include "tools/sim/points_world.h"

namespace relmap::testing {
namespace {

namespace fs = std::filesystem;

using std::chrono::milliseconds;
using std::chrono::seconds;
using std::chrono::steady_clock;

constexpr std::uint32_t kFrames = 24, kLabelled = 3;
constexpr const char* kLabel = "dock";

sim::PointsWorldOptions world_options() {
  sim::PointsWorldOptions options;
  options.frames = kFrames;
  options.frames_per_lap = 16;
  options.speed = 0.4;
  options.births = 16;
  options.appearance = 80;
  return options;
}

struct Fault {
  FaultKind kind = FaultKind::kOpen;
  std::uint64_t n = 0;  // 0: none
  int error = 0;        // 0: it succeeds at last
  milliseconds hang{0};

  std::string to_string() const {
    constexpr std::array kNames{"open", "write", "sync", "allocation"};
    return std::string(kNames.at(static_cast<std::size_t>(kind))) + " " + std::to_string(n) +
           (error == 0 ? " hangs" : std::string(" fails: ") + std::strerror(error));
  }
};

struct Course {
  bool hit = false;
  bool ended = false;              // by itself
  std::uint32_t acknowledged = 0;  // keyframes
  std::uint64_t reads = 0;         // answered with what was asked for
  std::uint64_t meanwhile = 0;     // of them while an operation hung
  milliseconds slowest{0};
  std::array<std::uint64_t, kFaultKinds> counts{};
  std::string last_words;
  std::vector<std::string> wrong;
};

// Asks again and again until it is told to stop.
class Reader {
 public:
  Reader(const RunningDaemon& daemon, const FileFaults& faults, milliseconds pause)
      : client_(daemon.client()), faults_(faults), pause_(pause), thread_([this] { ask(); }) {}
  ~Reader() { stop(); }
  void stop() {
    going_ = false;
    if (thread_.joinable()) thread_.join();
  }
  std::uint64_t answers() const { return answers_; }
  std::uint64_t meanwhile() const { return meanwhile_; }  // from before to after, an operation hung
  milliseconds slowest() const { return milliseconds(slowest_ms_); }

 private:
  void timed(const std::function<Status()>& question) {
    const auto start = steady_clock::now();
    const bool hung = faults_.hanging();
    const Status answer = question();
    const auto took = std::chrono::duration_cast<milliseconds>(steady_clock::now() - start);
    if (answer.ok()) ++answers_;
    if (answer.ok() && hung && faults_.hanging()) ++meanwhile_;
    if (answer.reason() != Reason::UNREACHABLE)  // it has ended
      slowest_ms_ = std::max<std::int64_t>(slowest_ms_, took.count());
  }
  void ask() {
    while (going_) {
      timed([&] { return client_->status().status(); });
      timed([&] { return client_->find_route({.from = FrameId{1, 0}, .to = FrameId{1, 4}}).status(); });
      timed([&] {
        return client_->localise({.left = "", .right = "", .camera = {}, .frame = FrameId{1, 2}}).status();
      });
      std::this_thread::sleep_for(pause_);
    }
  }

  const std::unique_ptr<client::Client> client_;
  const FileFaults& faults_;
  const milliseconds pause_;
  std::atomic<bool> going_{true};
  std::atomic<std::uint64_t> answers_{0}, meanwhile_{0};
  std::atomic<std::int64_t> slowest_ms_{0};
  std::thread thread_;
};

class FaultyRun {
 public:
  explicit FaultyRun(const Fault& fault) : fault_(fault) {}

  Course everything() {
    try {
      options_.data = folder_ / "disk/map";
      options_.lcm = random_lcm_url();
      fs::create_directories(folder_ / "disk");
      with_the_fault();
      without_it();
    } catch (const std::exception& error) {
      wrong(error.what());
    }
    return course_;
  }

 private:
  void with_the_fault() {
    FileFaults faults(folder_ / "disk", folder_ / "notes", Recording::kOff);
    if (fault_.n > 0) faults.fail(fault_.kind, fault_.n, fault_.error, fault_.hang);
    DaemonOptions options = options_;
    options.environment = faults.environment();
    RunningDaemon daemon(options, milliseconds(0));
    const auto deadline = steady_clock::now() + kPatience;
    while (daemon.process().running() && !daemon.serving() && steady_clock::now() < deadline)
      std::this_thread::sleep_for(milliseconds(5));
    if (daemon.serving() && daemon.process().running()) work(daemon, faults);
    if (!daemon.process().running()) {
      course_.ended = true;
      expect_a_reason(daemon, daemon.process().wait(milliseconds(0)).value_or(-1));
    } else if (const int code = daemon.stop(); code != 0) {
      expect_a_reason(daemon, code);
    }
    course_.hit = faults.hit();
    for (std::size_t kind = 0; kind < kFaultKinds; ++kind)
      course_.counts[kind] = faults.count(static_cast<FaultKind>(kind));
  }

  // What a robot, an operator and readers do. Whatever ends the daemon ends this.
  void work(RunningDaemon& daemon, const FileFaults& faults) {
    const auto client = client::Client::connect(options_.data);
    if (!client.ok()) return;
    HandRobot robot(options_.lcm, world_.options().uuid);
    Reader reader(daemon, faults, std::max(milliseconds(10), fault_.hang / 80));
    for (std::uint32_t i = 0; i < kFrames && settle(robot, daemon, **client, i); ++i) {
      if (i == kFrames / 2) labelled_ = (*client)->set_label(FrameId{1, kLabelled}, kLabel).ok();
      if (i == kFrames * 2 / 3) (void)(*client)->commit();
    }
    if (course_.acknowledged == kFrames) (void)(*client)->wait_idle();
    reader.stop();
    course_.reads = reader.answers();
    course_.meanwhile = reader.meanwhile();
    course_.slowest = reader.slowest();
  }

  // False: the daemon has ended, or takes nothing in until it is started again.
  bool settle(HandRobot& robot, RunningDaemon& daemon, client::Client& client, std::uint32_t sequence) {
    const Bytes payload = encode_keyframe(world_.keyframe(sequence));
    const auto deadline = steady_clock::now() + kPatience;
    for (int attempt = 1; steady_clock::now() < deadline; ++attempt) {
      robot.say_payload(sequence, payload);
      for (int i = 0; i < 20; ++i) {
        const auto ack = robot.acknowledgement();
        if (ack && ack->next_sequence > sequence) {
          course_.acknowledged = sequence + 1;
          return true;
        }
        std::this_thread::sleep_for(milliseconds(5));
      }
      if (!daemon.process().running()) return false;
      if (attempt % 10 == 0)
        if (const auto status = client.status(); status.ok() && status->storage.reason() == Reason::READ_ONLY) {
          course_.last_words = status->storage.to_string();
          return false;
        }
    }
    throw std::runtime_error("keyframe " + std::to_string(sequence) + " is not settled: " + daemon.log());
  }

  void expect_a_reason(const RunningDaemon& daemon, int code) {
    const std::string log = daemon.log();
    course_.last_words = "exit code " + std::to_string(code) + ": " +
                         log.substr(std::min(log.size(), log.size() - std::min<std::size_t>(log.size(), 400)));
    static const std::regex kReason(R"(\[(error|critical)\][^\n]* ?[A-Z_]{5,}: [^\n]+)");
    if (!std::regex_search(log, kReason)) wrong("ended without a reason: " + course_.last_words);
  }

  void without_it() {
    RunningDaemon daemon(options_);
    const auto client = daemon.client();
    throw_if(client->wait_idle());
    const client::DaemonStatus found = client->status().or_throw();
    if (!found.storage.ok()) wrong("after the next start: " + found.storage.to_string());
    if (found.frames < course_.acknowledged)
      wrong(std::to_string(course_.acknowledged) + " keyframes were acknowledged, " + std::to_string(found.frames) +
            " are there");
    HandRobot robot(options_.lcm, world_.options().uuid);
    for (std::uint32_t i = 0; i < kFrames; ++i)
      if (!settle(robot, daemon, *client, i)) return wrong("the next start takes nothing in: " + course_.last_words);
    throw_if(client->wait_idle());
    const client::DaemonStatus status = client->status().or_throw();
    if (status.frames != kFrames || status.gaps + status.refused > 0)
      wrong(std::to_string(status.frames) + " frames, " + std::to_string(status.gaps) + " gaps, " +
            std::to_string(status.refused) + " refused");
    if (labelled_ && client->labels(kLabel).or_throw().empty()) wrong("the label is lost");
    if (daemon.stop() != 0) wrong("the next daemon: " + daemon.log());
    std::vector<Keyframe> keyframes;
    for (std::uint32_t i = 0; i < kFrames; ++i) keyframes.push_back(world_.keyframe(i));
    const auto map = open_stored_map(options_.data);
    for (const std::string& difference : settled_once_differences(*map, keyframes)) wrong(difference);
    storage::verify(*map->view(), {},
                    [&](const storage::Finding& f) { wrong("verify: " + f.frame.to_string() + " " + f.what); }, {})
        .or_throw();
  }

  void wrong(const std::string& what) { course_.wrong.push_back(fault_.to_string() + ": " + what); }

  const Fault fault_;
  const storage::TemporaryFolder folder_;
  const sim::PointsWorld world_{world_options()};
  DaemonOptions options_;
  bool labelled_ = false;
  Course course_;
};

class NthFailure : public ::testing::Test {
 protected:
  // How often the daemon does each in a run without a fault.
  std::uint64_t total(FaultKind kind) {
    static const Course kWithout = FaultyRun({}).everything();
    EXPECT_THAT(kWithout.wrong, ::testing::IsEmpty());
    EXPECT_EQ(kWithout.acknowledged, kFrames);
    return kWithout.counts[static_cast<std::size_t>(kind)];
  }

  // `number` of the operations of this kind, evenly spread; 0: every one. The first and the last are among those that
  // fail, but not among those that hang: nobody reads before the start or after the end.
  std::vector<Fault> faults(FaultKind kind, std::uint64_t number, int error, milliseconds hang = {}) {
    const std::uint64_t all = total(kind);
    if (number == 0 || number > all) number = all;
    std::vector<Fault> chosen;
    for (std::uint64_t i = 0; i < number; ++i)
      chosen.push_back({kind,
                        1 + (hang.count() > 0 ? (2 * i + 1) * all / (2 * number)
                                              : i * (all - 1) / std::max<std::uint64_t>(number - 1, 1)),
                        error, hang});
    return chosen;
  }
  std::vector<Fault> hangs(std::uint64_t number, milliseconds hang) {
    std::vector<Fault> chosen;
    for (const FaultKind kind : {FaultKind::kOpen, FaultKind::kWrite, FaultKind::kSync})
      for (const Fault& fault : faults(kind, number, 0, hang)) chosen.push_back(fault);
    return chosen;
  }

  // So many runs at a time.
  void run(const std::vector<Fault>& all, std::size_t at_once = 1) {
    const milliseconds hang = all.front().hang;
    std::atomic<std::size_t> next{0};
    std::vector<std::future<std::vector<Course>>> workers;
    for (std::size_t worker = 0; worker < at_once; ++worker)
      workers.push_back(std::async(std::launch::async, [&] {
        std::vector<Course> courses;
        for (std::size_t i; (i = next++) < all.size();) courses.push_back(FaultyRun(all[i]).everything());
        return courses;
      }));
    std::size_t hit = 0, ended = 0, read_only = 0;
    std::uint64_t reads = 0, meanwhile = 0;
    milliseconds slowest{0};
    for (auto& worker : workers)
      for (const Course& course : worker.get()) {
        hit += course.hit;
        ended += course.ended;
        read_only += !course.ended && course.acknowledged < kFrames;
        reads += course.reads;
        meanwhile += course.meanwhile;
        slowest = std::max(slowest, course.slowest);
        EXPECT_THAT(course.wrong, ::testing::IsEmpty());
      }
    std::printf(
        "%zu faults, %zu hit, %zu ended, %zu read only, %llu reads answered, %llu of them meanwhile, the slowest "
        "in %lld ms\n",
        all.size(), hit, ended, read_only, static_cast<unsigned long long>(reads),
        static_cast<unsigned long long>(meanwhile), static_cast<long long>(slowest.count()));
    EXPECT_GE(hit * 2, all.size());
    EXPECT_GT(reads, 0u);
    if (hang.count() > 0) {
      EXPECT_LT(slowest, hang / 2);
      EXPECT_GT(meanwhile, all.size());
    }
  }
};

TEST_F(NthFailure, Open) { run(faults(FaultKind::kOpen, 4, EMFILE)); }
TEST_F(NthFailure, Write) { run(faults(FaultKind::kWrite, 4, EIO)); }
TEST_F(NthFailure, WriteOnAFullDisk) { run(faults(FaultKind::kWrite, 3, ENOSPC)); }
TEST_F(NthFailure, Sync) { run(faults(FaultKind::kSync, 4, EIO)); }
TEST_F(NthFailure, Allocation) { run(faults(FaultKind::kAllocation, 5, ENOMEM)); }
TEST_F(NthFailure, Hang) { run(hangs(2, seconds(15)), 6); }

class LongNthFailure : public NthFailure {};

TEST_F(LongNthFailure, Open) { run(faults(FaultKind::kOpen, 0, EMFILE), 2); }
TEST_F(LongNthFailure, Write) { run(faults(FaultKind::kWrite, 0, EIO), 2); }
TEST_F(LongNthFailure, WriteOnAFullDisk) { run(faults(FaultKind::kWrite, 0, ENOSPC), 2); }
TEST_F(LongNthFailure, Sync) { run(faults(FaultKind::kSync, 0, EIO), 2); }
TEST_F(LongNthFailure, Allocation) { run(faults(FaultKind::kAllocation, 1000, ENOMEM), 2); }
TEST_F(LongNthFailure, Hang) { run(hangs(0, seconds(60)), 12); }

}  // namespace
}  // namespace relmap::testing
