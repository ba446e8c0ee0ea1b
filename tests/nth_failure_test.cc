// The n-th open, write, sync or allocation of relmapd fails or hangs, while two robots send drives, an operator labels
// a frame, proposes an edge, has the map committed and compacted and a session deleted, and readers ask. Readers are
// answered meanwhile; the daemon goes on, or ends with a reason; the next start has everything that was acknowledged.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <filesystem>
#include <future>
#include <regex>
#include <thread>

#include "proto/base/crc32c.h"
#include "storage/rocksdb/rocksdb_engine.h"
#include "storage/testing/temporary_folder.h"
#include "tests/file_faults/traced_program.h"
#include "tests/support/hand_robot.h"
#include "tests/support/running_daemon.h"
#include "tests/support/small_world.h"
#include "tests/support/stored_map.h"
#include "tests/support/verify_findings.h"

namespace relmap::testing {
namespace {

namespace fs = std::filesystem;

using std::chrono::milliseconds;
using std::chrono::seconds;
using std::chrono::steady_clock;

constexpr std::uint32_t kFrames = 24, kLap = 16, kLabelled = 3;
constexpr std::uint32_t kOtherFrames = 6;  // of the session that is deleted
constexpr const char* kLabel = "dock";

constexpr std::array kKindNames{"open", "write", "sync", "allocation"};

struct Fault {
  FaultKind kind = FaultKind::kOpen;
  std::uint64_t n = 0;  // 0: none
  int error = 0;        // 0: it succeeds at last
  milliseconds hang{0};

  std::string to_string() const {
    return std::string(kKindNames.at(static_cast<std::size_t>(kind))) + " " + std::to_string(n) +
           (error == 0 ? " hangs" : std::string(" fails: ") + std::strerror(error));
  }
};

struct Course {
  Fault fault;
  bool hit = false;
  bool hit_at_work = false;        // while the daemon served and readers asked
  bool ended = false;              // by itself
  std::uint32_t acknowledged = 0;  // keyframes
  std::uint64_t reads = 0;         // answered with what was asked for
  std::uint64_t meanwhile = 0;     // of them while an operation hung
  milliseconds slowest{0};
  milliseconds took{0};  // the whole run
  std::array<std::uint64_t, kFaultKinds> counts{}, before_work{}, after_work{};
  std::string last_words;
  std::vector<std::string> undone;  // of the operator's work
  std::vector<std::string> wrong;
};

// Asks again and again until it is told to stop.
class Reader {
 public:
  Reader(client::Client& client, const FileFaults& faults, milliseconds pause)
      : client_(client), faults_(faults), pause_(pause), thread_([this] { ask(); }) {}
  ~Reader() { stop(); }
  void stop() {
    going_ = false;
    if (thread_.joinable()) thread_.join();
  }
  std::uint64_t answers() const { return answers_; }
  std::uint64_t meanwhile() const { return meanwhile_; }  // answers during the whole of which an operation hung
  milliseconds slowest() const { return milliseconds(slowest_ms_); }
  // Answers that are neither what was asked for, nor that there is no such thing yet, nor that nobody answers. After
  // stop().
  const std::vector<std::string>& refusals() const { return refusals_; }
  std::uint64_t unreachable() const { return unreachable_; }  // nobody answered

 private:
  static bool is_answered(Reason reason) { return reason == Reason::OK || reason == Reason::NEW_PLACE; }
  static bool is_expected(Reason reason) {
    switch (reason) {
      case Reason::UNREACHABLE:
      case Reason::DEADLINE:
      case Reason::NO_SUCH_SESSION:
      case Reason::NO_SUCH_FRAME:
        return true;
      default:
        return false;
    }
  }
  void timed(const std::function<Status()>& question) {
    const auto start = steady_clock::now();
    const bool hung = faults_.hanging();
    const Status answer = question();
    const auto took = std::chrono::duration_cast<milliseconds>(steady_clock::now() - start);
    if (is_answered(answer.reason())) {
      ++answers_;
      if (hung && faults_.hanging()) ++meanwhile_;
    } else if (!is_expected(answer.reason())) {
      refusals_.push_back(answer.to_string());
    }
    if (answer.reason() == Reason::UNREACHABLE)
      ++unreachable_;
    else
      slowest_ms_ = std::max<std::int64_t>(slowest_ms_, took.count());
  }
  void ask() {
    while (going_) {
      timed([&] { return client_.status().status(); });
      timed([&] { return client_.find_route({.from = FrameId{1, 0}, .to = FrameId{1, 4}}).status(); });
      timed([&] { return client_.localise({.left = "", .right = "", .camera = {}, .frame = FrameId{1, 2}}).status(); });
      std::this_thread::sleep_for(pause_);
    }
  }

  client::Client& client_;
  const FileFaults& faults_;
  const milliseconds pause_;
  std::atomic<bool> going_{true};
  std::atomic<std::uint64_t> answers_{0}, meanwhile_{0}, unreachable_{0};
  std::atomic<std::int64_t> slowest_ms_{0};
  std::vector<std::string> refusals_;
  std::thread thread_;
};

class FaultyRun {
 public:
  explicit FaultyRun(const Fault& fault) : fault_(fault) { course_.fault = fault; }

  Course everything() {
    const auto start = steady_clock::now();
    try {
      options_.data = folder_ / "disk/map";
      options_.lcm = random_lcm_url();
      fs::create_directories(folder_ / "disk");
      with_the_fault();
      without_it();
    } catch (const std::exception& error) {
      wrong(error.what());
    }
    course_.took = std::chrono::duration_cast<milliseconds>(steady_clock::now() - start);
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
    if (daemon.serving())
      work(daemon, faults);
    else if (daemon.process().running())
      wrong("the daemon neither serves nor ends: " + daemon.log());
    if (!daemon.process().running()) {
      course_.ended = true;
      expect_a_reason(daemon, daemon.process().wait(milliseconds(0)).value_or(-1));
    } else if (const int code = daemon.stop(); code != 0) {
      expect_a_reason(daemon, code);
    }
    course_.hit = faults.hit();
    course_.counts = counts(faults);
  }

  static std::array<std::uint64_t, kFaultKinds> counts(const FileFaults& faults) {
    std::array<std::uint64_t, kFaultKinds> all{};
    for (std::size_t kind = 0; kind < kFaultKinds; ++kind) all[kind] = faults.count(static_cast<FaultKind>(kind));
    return all;
  }

  // Null: the daemon ends. Whoever it lets in must be answered.
  std::unique_ptr<client::Client> connect(RunningDaemon& daemon) {
    auto client = client::Client::connect(options_.data);
    if (!client.ok() && may_refuse() && client.reason() != Reason::UNREACHABLE)
      client = client::Client::connect(options_.data);
    if (client.ok()) return std::move(*client);
    if (!daemon.process().wait(kPatience)) wrong("nobody can connect: " + client.status().to_string());
    return nullptr;
  }

  // What a robot, an operator and readers do. Whatever ends the daemon ends this.
  void work(RunningDaemon& daemon, const FileFaults& faults) {
    const auto client = connect(daemon), readers_client = client ? connect(daemon) : nullptr;
    if (!readers_client) return;
    course_.before_work = counts(faults);
    const bool early = faults.hit();
    HandRobot robot(options_.lcm, world_.options().uuid), other_robot(options_.lcm, other_.options().uuid);
    Reader reader(*readers_client, faults, std::max(milliseconds(10), fault_.hang / 80));
    for (std::uint32_t i = 0; i < kFrames && settle(robot, daemon, *client, i); ++i) {
      if (i == 0)
        for (std::uint32_t other = 0; other < kOtherFrames; ++other)
          if (!settle(other_robot, daemon, *client, other_, other)) break;
      if (i == kFrames / 2) label(*client);
      if (i == kFrames * 2 / 3) done(client->commit().status());
      if (i == kFrames * 3 / 4) propose(*client);
      if (i == kFrames * 5 / 6)
        done(client->compact([](const auto&) { return true; }).status());  // opens and writes many files
      if (i == kFrames * 11 / 12) deleted_ = done(delete_other(*client));
    }
    const bool served = course_.acknowledged == kFrames && client->wait_idle().ok();
    course_.hit_at_work = faults.hit() && !early;
    while (faults.hanging() && daemon.process().running()) std::this_thread::sleep_for(milliseconds(5));
    reader.stop();
    course_.after_work = counts(faults);
    course_.reads = reader.answers();
    course_.meanwhile = reader.meanwhile();
    course_.slowest = reader.slowest();
    if (served && reader.unreachable() > 0) wrong("readers lost a daemon that goes on");
    judge(reader);
  }

  void judge(const Reader& reader) {
    if (reader.refusals().size() > (may_refuse() ? 1 : 0))
      wrong(std::to_string(reader.refusals().size()) +
            " answers to readers, the first of them: " + reader.refusals().front());
    if (fault_.hang.count() == 0 || !course_.hit_at_work) return;
    if (course_.meanwhile == 0) wrong("no reader was answered meanwhile");
    // Within a second where it hangs for a minute; other runs share this machine with whatever else it does.
    if (course_.slowest > fault_.hang / (fault_.hang >= seconds(60) ? 60 : 5))
      wrong("a reader waited for " + std::to_string(course_.slowest.count()) + " ms");
  }

  // Memory may run out where a question is answered, and a file that answers it may not open: once.
  bool may_refuse() const {
    return (fault_.kind == FaultKind::kAllocation || fault_.kind == FaultKind::kOpen) && fault_.error != 0;
  }

  bool done(const Status& work) {
    if (!work.ok()) course_.undone.push_back(work.to_string());
    return work.ok();
  }

  // After a fault the sessions may have other numbers than in the order in which they began.
  void label(client::Client& client) {
    const auto own = find_session(client, world_);
    labelled_ = own && done(client.set_label(FrameId{own->number, kLabelled}, kLabel).status());
  }
  // Where the place is the same, the daemon has found a closure already: WRONG_STATE, after the geometry was done.
  void propose(client::Client& client) {
    const auto own = find_session(client, world_), other = find_session(client, other_);
    if (!own || !other) return;
    const Status proposed = client.propose_edge(FrameId{own->number, 2}, FrameId{other->number, 2}).status();
    if (proposed.reason() != Reason::WRONG_STATE) done(proposed);
  }

  // False: the daemon has ended, or takes nothing in until it is started again.
  bool settle(HandRobot& robot, RunningDaemon& daemon, client::Client& client, std::uint32_t sequence) {
    if (!settle(robot, daemon, client, world_, sequence)) return false;
    course_.acknowledged = sequence + 1;
    return true;
  }
  bool settle(HandRobot& robot, RunningDaemon& daemon, client::Client& client, const sim::PointsWorld& world,
              std::uint32_t sequence) {
    const Bytes payload = encode_keyframe(world.keyframe(sequence));
    const auto deadline = steady_clock::now() + kPatience;
    for (int attempt = 1; steady_clock::now() < deadline; ++attempt) {
      robot.say_payload(sequence, payload);
      for (int i = 0; i < 20; ++i) {
        const auto ack = robot.acknowledgement();
        if (ack && ack->next_sequence > sequence) return true;
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
    static const std::regex kReason(R"(\[(?:error|critical)\] (?:[^\n]*[ :])?([A-Z_]{5,}): [^\n]+)");
    bool reason = false;
    for (std::sregex_iterator found(log.begin(), log.end(), kReason); found != std::sregex_iterator(); ++found)
      reason = reason || (*found)[1] != "INTERNAL";
    if (code < 0 || code >= 128) wrong("crashed, or does not stop: " + course_.last_words);
    if (!reason) wrong("ended without a reason: " + course_.last_words);
  }

  void without_it() {
    RunningDaemon daemon(options_);
    const auto client = daemon.client();
    throw_if(client->wait_idle());
    const client::DaemonStatus found = client->status().or_throw();
    if (!found.storage.ok()) wrong("after the next start: " + found.storage.to_string());
    if (const std::uint64_t frames = frames_of(*client, world_); frames < course_.acknowledged)
      wrong(std::to_string(course_.acknowledged) + " keyframes were acknowledged, " + std::to_string(frames) +
            " are there");
    // It may have begun without a frame.
    if (const auto other = find_session(*client, other_); other && other->state != client::SessionState::kDeleting) {
      if (deleted_) wrong("the deleted session is back");
      throw_if(delete_other(*client));
    }
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
    // Opened once: a program that another thread starts holds the lock of the folder for a moment longer.
    const auto engine = storage::open_rocksdb(options_.data).or_throw();
    for (const std::string& finding : verify_findings(*engine)) wrong(finding);
    const auto budget = std::make_shared<storage::Budget>(std::size_t{1} << 30);
    const auto map = storage::Map::open(engine, engine->acquire().or_throw(), budget).or_throw();
    for (const std::string& difference : settled_once_differences(*map, keyframes)) wrong(difference);
  }

  static std::optional<client::Session> find_session(client::Client& client, const sim::PointsWorld& world) {
    const auto sessions = client.sessions();
    if (sessions.ok())
      for (const client::Session& session : *sessions)
        if (session.name == world.options().session) return session;
    return std::nullopt;
  }
  static std::uint64_t frames_of(client::Client& client, const sim::PointsWorld& world) {
    const auto session = find_session(client, world);
    return session ? session->frames : 0;
  }
  Status delete_other(client::Client& client) const {
    const auto session = find_session(client, other_);
    if (!session) return Status(Reason::NO_SUCH_SESSION, "");
    return client.delete_session(session->number, session->uuid, [](const auto&) { return true; });
  }

  void wrong(const std::string& what) { course_.wrong.push_back(fault_.to_string() + ": " + what); }

  const Fault fault_;
  const storage::TemporaryFolder folder_;
  const sim::PointsWorld world_{small_world(kFrames, kLap, 80)}, other_{small_world(kOtherFrames, kLap, 80, 2)};
  DaemonOptions options_;
  bool labelled_ = false, deleted_ = false;
  Course course_;
};

class NthFailure : public ::testing::Test {
 protected:
  // A run without a fault, which tells how often the daemon does what.
  static const Course& without() {
    static const Course kWithout = FaultyRun({}).everything();
    EXPECT_THAT(kWithout.wrong, ::testing::IsEmpty());
    EXPECT_EQ(kWithout.acknowledged, kFrames);
    EXPECT_THAT(kWithout.undone, ::testing::IsEmpty());
    EXPECT_GT(kWithout.reads, 0u);
    static const bool kTold = [] {
      for (std::size_t kind = 0; kind < kFaultKinds; ++kind)
        std::printf("%s: %llu, %llu of them before the daemon serves, %llu after its work\n", kKindNames.at(kind),
                    static_cast<unsigned long long>(kWithout.counts[kind]),
                    static_cast<unsigned long long>(kWithout.before_work[kind]),
                    static_cast<unsigned long long>(kWithout.counts[kind] - kWithout.after_work[kind]));
      return true;
    }();
    (void)kTold;
    return kWithout;
  }

  // `number` of the operations of this kind, evenly spread, the first and the last among them; 0: every one. Of those
  // that hang, if not every one, such as are done while the daemon serves, since nobody reads before or after.
  static std::vector<Fault> faults(FaultKind kind, std::uint64_t number, int error, milliseconds hang = {}) {
    const auto at = static_cast<std::size_t>(kind);
    const bool at_work = hang.count() > 0 && number > 0;
    const std::uint64_t first = at_work ? without().before_work[at] + 1 : 1;
    const std::uint64_t last = at_work ? without().after_work[at] : without().counts[at];
    EXPECT_GT(last, first);
    if (number == 0 || number > last - first + 1) number = last - first + 1;
    std::vector<Fault> chosen;
    for (std::uint64_t i = 0; i < number; ++i) {
      // In the middles of equal parts where no two runs are the same and all are to be hit.
      const std::uint64_t n = at_work ? (2 * i + 1) * (last - first) / (2 * number)
                                      : i * (last - first) / std::max<std::uint64_t>(number - 1, 1);
      chosen.push_back({kind, first + n, error, hang});
    }
    return chosen;
  }
  static std::vector<Fault> hangs(std::uint64_t number, milliseconds hang) {
    std::vector<Fault> chosen;
    for (const FaultKind kind : {FaultKind::kOpen, FaultKind::kWrite, FaultKind::kSync})
      for (const Fault& fault : faults(kind, number, 0, hang)) chosen.push_back(fault);
    return chosen;
  }

  enum class When { kAtWork, kAtTheStart };

  // So many runs at a time.
  static void run(const std::vector<Fault>& all, std::size_t at_once = 1, When when = When::kAtWork) {
    std::atomic<std::size_t> next{0};
    std::vector<std::future<std::vector<Course>>> workers;
    for (std::size_t worker = 0; worker < at_once; ++worker)
      workers.push_back(std::async(std::launch::async, [&] {
        std::vector<Course> courses;
        for (std::size_t i; (i = next++) < all.size();) courses.push_back(FaultyRun(all[i]).everything());
        return courses;
      }));
    std::size_t hit = 0, at_work = 0, ended = 0, read_only = 0;
    std::uint64_t reads = 0, meanwhile = 0;
    milliseconds slowest{0}, longest{0};
    Fault longest_with;
    for (auto& worker : workers)
      for (const Course& course : worker.get()) {
        EXPECT_THAT(course.wrong, ::testing::IsEmpty());
        expect_hit(course);
        hit += course.hit;
        at_work += course.hit_at_work;
        ended += course.ended;
        read_only += !course.ended && course.acknowledged < kFrames;
        reads += course.reads;
        meanwhile += course.meanwhile;
        slowest = std::max(slowest, course.slowest);
        if (course.took > longest) longest = course.took, longest_with = course.fault;
      }
    std::printf(
        "%zu faults, %zu hit, %zu of them at work, %zu ended, %zu read only, %llu reads answered, %llu of them "
        "meanwhile, the slowest in %lld ms; %s took longest, %lld ms\n",
        all.size(), hit, at_work, ended, read_only, static_cast<unsigned long long>(reads),
        static_cast<unsigned long long>(meanwhile), static_cast<long long>(slowest.count()),
        longest_with.to_string().c_str(), static_cast<long long>(longest.count()));
    EXPECT_GT(reads, 0u);
    EXPECT_TRUE(at_work > 0 || when == When::kAtTheStart);
  }

  // No two runs do the same number of operations, since the journal's thread syncs together what has come in, and
  // commits go by time. So the last ones may not be reached, and nothing but them.
  static void expect_hit(const Course& course) {
    const auto at = static_cast<std::size_t>(course.fault.kind);
    EXPECT_EQ(course.hit, course.counts[at] >= course.fault.n) << course.fault.to_string();
    EXPECT_TRUE(course.hit || course.fault.n > without().counts[at] * 2 / 3) << course.fault.to_string();
  }
};

TEST_F(NthFailure, Open) { run(faults(FaultKind::kOpen, 5, EMFILE)); }
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
// Every one until the daemon serves.
TEST_F(LongNthFailure, AllocationAtTheStart) {
  std::vector<Fault> all;
  for (std::uint64_t n = 1; n <= without().before_work[static_cast<std::size_t>(FaultKind::kAllocation)]; ++n)
    all.push_back({FaultKind::kAllocation, n, ENOMEM});
  run(all, 2, When::kAtTheStart);
}
TEST_F(LongNthFailure, Hang) { run(hangs(0, seconds(60)), 12); }

}  // namespace
}  // namespace relmap::testing
