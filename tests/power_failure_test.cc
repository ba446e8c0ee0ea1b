// The power fails at the file operations of the programs: of a first start, a backup, a restore, a repair, a migration,
// a reindex and a deletion. The programs run as they are, once; what each failure can leave is laid out from the record
// of their operations (tests/file_faults), and looked at by the code that a next start or a next command runs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <thread>

#include "server/map/derived.h"
#include "server/map/mapper.h"
#include "server/map/testing/points_drive.h"
#include "server/place/testing/random_vocabulary.h"
#include "storage/maintenance/reindex.h"
#include "storage/maintenance/stored_hash.h"
#include "storage/migrate/migrate.h"
#include "storage/rocksdb/folder.h"
#include "storage/rocksdb/recorded_hash.h"
#include "storage/rocksdb/repair_folder.h"
#include "storage/rocksdb/restore_folder.h"
#include "storage/rocksdb/rocksdb_engine.h"
#include "storage/testing/temporary_folder.h"
#include "tests/file_faults/disk_model.h"
#include "tests/file_faults/sweep.h"
#include "tests/file_faults/traced_program.h"
#include "tests/paths.h"
#include "tests/support/hand_robot.h"
#include "tests/support/running_daemon.h"
#include "tests/support/small_world.h"
#include "tests/support/verify_findings.h"

namespace relmap::testing {
namespace {

namespace fs = std::filesystem;

using std::chrono::milliseconds;
using std::chrono::steady_clock;
using storage::MapHash;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr std::uint32_t kLap = 25;

sim::PointsWorldOptions drive(std::uint32_t frames, std::uint8_t number) {
  return small_world(frames, kLap, 100, number);
}

const std::shared_ptr<const place::Vocabulary>& vocabulary() {
  static const auto kVocabulary = place::Vocabulary::load(built_program("../share/relmap/default.vocab")).or_throw();
  return kVocabulary;
}

// Without what is written only for people, or made again.
storage::RocksDbOptions small_engine() {
  storage::RocksDbOptions options;
  options.cache_bytes = std::size_t{8} << 20;
  options.space.low_water = 0;
  options.direct_io = false;
  return options;
}

Status going(std::uint64_t /*done*/, std::uint64_t /*total*/) { return {}; }

void verify_clean(const storage::Engine& engine) {
  for (const std::string& finding : verify_findings(engine)) throw BrokenPromise(finding);
}

MapHash hash_of(const std::string& data) {
  storage::RocksDbOptions options = small_engine();
  options.read_only = true;
  const auto engine = storage::open_rocksdb(data, options).or_throw();
  verify_clean(*engine);
  return storage::hash_stored(*engine->snapshot(), going).or_throw();
}

void promise_same(const MapHash& a, const MapHash& b, const std::string& what) {
  promise(a == b, what + " is another map");
}

std::unique_ptr<map::Mapper> start_mapper(const std::string& data) {
  map::MapperOptions options;
  options.folder = data;
  const auto engine = storage::open_rocksdb(data, small_engine()).or_throw();
  verify_clean(*engine);
  return map::Mapper::open(engine, std::make_shared<storage::Budget>(std::size_t{64} << 20), vocabulary(), options)
      .or_throw();
}

void send(map::Mapper& mapper, const sim::PointsWorld& world) {
  const SessionNumber session = mapper.begin_session(world.keyframe(0).session).or_throw();
  for (std::uint32_t i = 0; i < world.size(); ++i) {
    Result<std::uint64_t> taken = Status(Reason::BUDGET_EXCEEDED, "");
    while (taken.reason() == Reason::BUDGET_EXCEEDED) {  // the worker is behind on a busy machine
      storage::KeyframeRecord record = map::keyframe_record(world, i);
      record.session = session;
      taken = mapper.submit_and_wait(std::move(record));
      if (!taken.ok()) std::this_thread::sleep_for(milliseconds(10));
    }
    throw_if(taken.status());
  }
}

// Every keyframe below `frames`, as it was sent.
void promise_frames(const storage::Graph& map, const sim::PointsWorld& world, std::uint64_t frames) {
  const auto number = [&]() -> std::optional<SessionNumber> {
    for (const storage::Session& session : map.sessions())
      if (session.header.uuid == world.options().uuid) return session.number;
    return std::nullopt;
  }();
  promise(number || frames == 0, "the session " + world.options().session + " is lost");
  for (std::uint32_t i = 0; i < frames; ++i) {
    const auto hot = map.hot({*number, i});
    promise(hot != nullptr, "keyframe " + std::to_string(i) + " is lost");
    promise(hot->payload_crc == crc32c(encode_keyframe(world.keyframe(i))),
            "keyframe " + std::to_string(i) + " differs");
  }
}

// What a program did to a disk.
struct Trace {
  DiskModel before;
  std::vector<FileOperation> operations;
};

// A trace, and what is promised of every disk that a power failure leaves during it.
struct Scene {
  Trace trace;
  std::function<void(const LeftDisk&)> check;
};

// Done again, what was recorded gives the same files: the program has done nothing unseen. `again`: a second model of
// the disk before.
void expect_complete(DiskModel again, const std::vector<FileOperation>& operations, const std::string& disk) {
  const storage::TemporaryFolder folder;
  for (const FileOperation& operation : operations) again.apply(operation);
  again.lay_out(folder / "again", Survives::kEverything);
  // The daemon's log is written by the test.
  const Finished same = run_program({"diff", "-r", "-x", "map.log", disk, folder / "again"});
  EXPECT_EQ(same.exit_code, 0) << same.standard_output << same.standard_error;
}

class PowerFailure : public ::testing::Test {
 protected:
  PowerFailure() { fs::create_directories(disk_); }

  // A map at rest. With `journal_only`, the last frames stand in the journal, and the rest in tables and blobs.
  void make_map(const std::string& data, const std::vector<std::uint32_t>& frames, std::uint32_t journal_only = 0) {
    {
      const auto mapper = start_mapper(data);
      for (std::size_t i = 0; i < frames.size(); ++i)
        send(*mapper, sim::PointsWorld(drive(frames[i], static_cast<std::uint8_t>(i + 1))));
      throw_if(mapper->wait_idle(steady_clock::now() + kPatience));
      throw_if(mapper->stop());
    }
    if (journal_only == 0) return;
    const auto engine = storage::open_rocksdb(data, small_engine()).or_throw();
    throw_if(engine->compact(going));
    const std::uint64_t epoch = engine->acquire().or_throw();
    const sim::PointsWorld world(drive(frames.front() + journal_only, 1));
    for (std::uint32_t i = frames.front(); i < world.size(); ++i) {
      const Bytes record = storage::encode_record(map::keyframe_record(world, i), engine->last_journal_sequence());
      (void)engine->append(epoch, {&record, 1}).or_throw();
    }
  }

  // Runs a program of the operator to its end on a disk.
  Trace record(const std::string& disk, std::vector<std::string> arguments, const std::set<int>& exit_codes = {0}) {
    Trace trace{DiskModel(disk), {}};
    DiskModel again(disk);
    const FileFaults faults(disk, folder_ / "notes", Recording::kOn);
    arguments.insert(arguments.begin(), built_program("relmap-admin"));
    const Finished run = run_program(arguments, kPatience, faults.environment());
    EXPECT_TRUE(exit_codes.contains(run.exit_code)) << run.exit_code << run.standard_output << run.standard_error;
    trace.operations = faults.operations();
    expect_complete(std::move(again), trace.operations, disk);
    return trace;
  }

  void expect_kept(Trace trace, const Thoroughness& how, const std::function<void(const LeftDisk&)>& check) {
    bool finished = false;
    const SweepResult result =
        fail_power_during(std::move(trace.before), trace.operations, how, [&](const LeftDisk& left) {
          finished = finished || left.finished;
          check(left);
        });
    EXPECT_THAT(result.wrong, IsEmpty()) << result.summary();
    EXPECT_GE(result.states, 30u) << "hardly anything was recorded";
    EXPECT_TRUE(finished || !result.wrong.empty());
    RecordProperty("operations", static_cast<int>(result.operations));
    RecordProperty("states", static_cast<int>(result.states));
    std::printf("%s\n", result.summary().c_str());
  }

  void first_start(const Thoroughness& how);
  void failed_syncs(int number, const Thoroughness& how);
  Scene backup();
  void restore(const Thoroughness& how);
  std::function<void(const LeftDisk&)> after_repair(const MapHash& hash);
  Scene repair();
  void repair_again(int number, const Thoroughness& how);
  void migrate(int format, const Thoroughness& how);
  void reindex(const Thoroughness& how);
  void deletion(const Thoroughness& how);

  const storage::TemporaryFolder folder_;
  const std::string disk_ = folder_ / "disk";
};

// What the daemon has acknowledged, and after how many operations.
struct Told {
  std::uint64_t operations = 0, next_sequence = 0;
};

std::uint64_t acknowledged(const std::vector<Told>& told, std::uint64_t operations) {
  std::uint64_t next = 0;
  for (const Told& one : told)
    if (one.operations <= operations) next = one.next_sequence;
  return next;
}

struct FirstStart {
  Trace trace;
  std::vector<Told> told;
  std::uint64_t syncs = 0, syncs_before_serving = 0;
};

// Sends a keyframe until it is acknowledged. Looks so often that what is recorded until then is what the
// acknowledgement rests on. False if the daemon has ended, or has not acknowledged it after `patience`.
bool settle(HandRobot& robot, RunningDaemon& daemon, std::uint32_t sequence, const Bytes& payload,
            milliseconds patience) {
  const auto deadline = steady_clock::now() + patience;
  while (daemon.process().running() && steady_clock::now() < deadline) {
    robot.say_payload(sequence, payload);
    for (int i = 0; i < 500; ++i) {
      const auto ack = robot.acknowledgement();
      if (ack && ack->next_sequence > sequence) return true;
      std::this_thread::sleep_for(std::chrono::microseconds(200));
    }
  }
  return false;
}

// A daemon makes its map, three folders deep, and takes a drive in. With a sync that fails it may end before, or take
// nothing more in.
FirstStart record_first_start(const std::string& disk, const std::string& notes, const sim::PointsWorld& world,
                              std::uint64_t failing_sync = 0) {
  fs::create_directories(disk + "/srv");  // for the daemon's log
  FirstStart start{{DiskModel(disk), {}}, {}};
  DiskModel again(disk);
  FileFaults faults(disk, notes, Recording::kOn);
  const bool certain = failing_sync == 0;
  if (!certain) faults.fail(FaultKind::kSync, failing_sync, EIO);
  DaemonOptions options;
  options.data = disk + "/srv/maps/map";
  options.lcm = random_lcm_url();
  options.environment = faults.environment();
  RunningDaemon daemon(options);
  start.syncs_before_serving = faults.count(FaultKind::kSync);
  {
    const auto client = daemon.client();
    HandRobot robot(options.lcm, world.options().uuid);
    for (std::uint32_t i = 0; i < world.size(); ++i) {
      if (!settle(robot, daemon, i, encode_keyframe(world.keyframe(i)), certain ? kPatience : milliseconds(3000)))
        break;
      start.told.push_back({faults.recorded(), i + 1});
      if (i == world.size() / 2) (void)client->commit();
    }
    if (certain) throw_if(client->wait_idle());
  }
  const int code = daemon.stop();
  if (code < 0 || (certain && (code != 0 || start.told.size() < world.size()))) throw std::runtime_error(daemon.log());
  EXPECT_EQ(faults.hit(), !certain);
  start.trace.operations = faults.operations();
  start.syncs = faults.count(FaultKind::kSync);
  // What a failed sync drops, the running program still sees.
  if (certain) expect_complete(std::move(again), start.trace.operations, disk);
  return start;
}

// The map, as a daemon would find it: nothing that was acknowledged is lost, and what follows goes in.
void check_first_start(const std::string& data, const sim::PointsWorld& world, std::uint64_t acknowledged) {
  {
    const auto mapper = start_mapper(data);
    promise_frames(*mapper->view(), world, acknowledged);
    throw_if(mapper->stop());
  }
  const auto mapper = start_mapper(data);
  promise_frames(*mapper->view(), world, acknowledged);
  const auto sessions = mapper->view()->sessions();
  promise(sessions.size() <= 1, "the session is there twice");
  const std::uint64_t next = sessions.empty() ? 0 : sessions.front().next_sequence;
  const SessionNumber session = mapper->begin_session(world.keyframe(0).session).or_throw();
  if (next < world.size()) {
    storage::KeyframeRecord record = map::keyframe_record(world, static_cast<std::uint32_t>(next));
    record.session = session;
    const std::uint64_t sequence = mapper->submit_and_wait(std::move(record)).or_throw();
    throw_if(mapper->wait_applied(sequence, steady_clock::now() + kPatience));
    promise_frames(*mapper->view(), world, next + 1);
  }
  throw_if(mapper->stop());
}

void check_daemon(const std::string& data, std::uint64_t frames) {
  RunningDaemon daemon({.data = data, .lcm = "", .more = {}});
  throw_if(daemon.client()->wait_idle());
  const client::DaemonStatus status = daemon.client()->status().or_throw();
  throw_if(status.storage);
  promise(status.frames >= frames, "the daemon serves " + std::to_string(status.frames) + " frames only");
  promise(daemon.stop() == 0, daemon.log());
}

void PowerFailure::first_start(const Thoroughness& how) {
  const sim::PointsWorld world(drive(36, 1));
  FirstStart start = record_first_start(disk_, folder_ / "notes", world);
  expect_kept(std::move(start.trace), how, [&](const LeftDisk& left) {
    const std::string data = left.root + "/srv/maps/map";
    const std::uint64_t frames = acknowledged(start.told, left.operations);
    promise(!left.finished || frames == world.size(), "the test knows of too few acknowledgements");
    if (left.number % 8 == 5) check_daemon(data, frames);
    check_first_start(data, world, frames);
  });
}

// One sync of the daemon fails while it serves, after which the kernel has dropped what was not on the disk; then, or
// later, the power fails. `number` of the syncs, evenly spread; 0: every one.
void PowerFailure::failed_syncs(int number, const Thoroughness& how) {
  const sim::PointsWorld world(drive(24, 1));
  const FirstStart without = record_first_start(disk_, folder_ / "notes", world);
  const std::uint64_t first = without.syncs_before_serving + 1;
  const std::uint64_t last = without.syncs * 3 / 4;  // no two runs are the same
  ASSERT_GT(last, first + 5);
  const std::uint64_t step = number == 0 ? 1 : (last - first) / static_cast<std::uint64_t>(number - 1);
  for (std::uint64_t n = first; n <= last; n += step) {
    SCOPED_TRACE("sync " + std::to_string(n));
    FirstStart start =
        record_first_start(folder_ / ("disk-" + std::to_string(n)), folder_ / ("notes-" + std::to_string(n)), world, n);
    expect_kept(std::move(start.trace), how, [&](const LeftDisk& left) {
      check_first_start(left.root + "/srv/maps/map", world, acknowledged(start.told, left.operations));
    });
  }
}

Scene PowerFailure::backup() {
  make_map(disk_ + "/map", {40, 30});
  fs::create_directories(disk_ + "/backups");
  const auto back_up = [](const std::string& root, const std::string& name) {
    storage::RocksDbOptions options = small_engine();
    throw_if(storage::open_rocksdb(root + "/map", options).or_throw()->checkpoint(root + "/backups/" + name, going));
  };
  back_up(disk_, "earlier");
  const MapHash hash = hash_of(disk_ + "/map");
  return {record(disk_, {"backup", disk_ + "/map", disk_ + "/backups/new"}), [=](const LeftDisk& left) {
            promise_same(hash_of(left.root + "/map"), hash, "the map");
            promise_same(hash_of(left.root + "/backups/earlier"), hash, "the earlier backup");
            const std::string made = left.root + "/backups/new";
            if (left.finished) promise(fs::exists(made), "the finished backup is lost");
            if (!fs::exists(made)) back_up(left.root, "new");
            promise_same(hash_of(made), hash, "the backup");
            promise(storage::read_recorded_hash(made).or_throw().has_value(), "the backup has no hash");
            promise(!fs::exists(made + ".partial"), "an unfinished backup is left");
            promise_same(hash_of(left.root + "/map"), hash, "the map after its backup");
          }};
}

void PowerFailure::restore(const Thoroughness& how) {
  make_map(folder_ / "map", {40, 30});
  const std::string copy = disk_ + "/backup";
  throw_if(storage::open_rocksdb(folder_ / "map", small_engine()).or_throw()->checkpoint(copy, going));
  const MapHash hash = hash_of(copy);
  Trace trace = record(disk_, {"restore", copy, disk_ + "/restored"});
  const MapHash restored_hash = hash_of(disk_ + "/restored");
  expect_kept(std::move(trace), how, [&](const LeftDisk& left) {
    const std::string from = left.root + "/backup", to = left.root + "/restored";
    promise_same(hash_of(from), hash, "the backup");
    if (left.finished) promise(fs::exists(to), "the restored map is lost");
    if (!fs::exists(to)) (void)storage::restore_folder(from, to, 1, going).or_throw();
    promise_same(hash_of(to), restored_hash, "the restored map");
    promise(!fs::exists(to + ".partial"), "an unfinished restore is left");
    const auto mapper = start_mapper(to);
    promise(mapper->identity().epoch > 0, "the restored map passes for the one that was backed up");
    throw_if(mapper->stop());
  });
}

// A byte in the middle of a file.
void spoil(const fs::path& path) {
  const auto middle = static_cast<std::streamoff>(fs::file_size(path) / 2);
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  file.seekg(middle);
  const int byte = file.get();
  file.seekp(middle);
  file.put(static_cast<char>(byte ^ 0x55));
}

fs::path largest(const std::string& folder, const std::vector<std::string>& kinds) {
  fs::path found;
  for (const auto& entry : fs::directory_iterator(folder))
    if (std::find(kinds.begin(), kinds.end(), entry.path().extension()) != kinds.end())
      if (found.empty() || entry.file_size() > fs::file_size(found)) found = entry.path();
  return found;
}

// What is promised of a map while it is repaired; `hash`: of the repaired map.
std::function<void(const LeftDisk&)> PowerFailure::after_repair(const MapHash& hash) {
  return [=](const LeftDisk& left) {
    const std::string own = left.root + "/map";
    if (!left.finished) {
      // Whoever starts the daemon first is told to repair the map, or has one.
      const auto opened = storage::open_rocksdb(own, small_engine());
      promise(opened.ok() || opened.reason() == Reason::DATA_LOSS || opened.reason() == Reason::UNKNOWN_FORMAT_VERSION,
              "the daemon says " + opened.status().to_string());
    } else {
      promise_same(hash_of(own), hash, "the finished repair");
    }
    const auto again = storage::repair_folder(own, {}, {}, {}).or_throw();
    promise(again.remaining == 0, "repair leaves something wrong");
    promise_same(hash_of(own), hash, "the repaired map");
    promise(!fs::exists(own + "/salvage"), "repair leaves its work");
    const auto mapper = start_mapper(own);
    throw_if(mapper->stop());
  };
}

Scene PowerFailure::repair() {
  const std::string data = disk_ + "/map";
  make_map(data, {40, 30}, 8);
  spoil(largest(data + "/map", {".sst"}));
  spoil(largest(data + "/map", {".blob"}));
  spoil(largest(data + "/journal", {".log"}));
  std::ofstream(data + "/FORMAT") << "re";
  Trace trace = record(disk_, {"repair", data}, {3});
  return {std::move(trace), after_repair(hash_of(data))};
}

// The power fails during a repair, and again during the repair of what that left. `number` of such second repairs,
// after operations of the first that are evenly spread.
void PowerFailure::repair_again(int number, const Thoroughness& how) {
  Scene first = repair();
  first.trace.before.lay_out(folder_ / "spoilt", Survives::kDurable);
  const std::vector<FileOperation>& operations = first.trace.operations;
  for (int i = 1; i <= number; ++i) {
    const std::size_t through = operations.size() * static_cast<std::size_t>(i) / static_cast<std::size_t>(number + 1);
    SCOPED_TRACE("after operation " + std::to_string(through));
    DiskModel disk(folder_ / "spoilt");
    for (std::size_t at = 0; at < through; ++at) disk.apply(operations[at]);
    const std::string left = folder_ / ("left-" + std::to_string(i));
    disk.lay_out(left, Survives::kSome, static_cast<std::uint64_t>(i));
    expect_kept(record(left, {"repair", left + "/map"}, {0, 3}), how, first.check);
  }
}

void PowerFailure::migrate(int format, const Thoroughness& how) {
  const std::string data = disk_ + "/map", number = std::to_string(format);
  fs::create_directories(data);
  ASSERT_EQ(
      std::system(
          ("tar -C " + data + " -xJf " RELMAP_SOURCE_DIR "/tests/fixtures/map-format-" + number + ".tar.xz").c_str()),
      0);
  Trace trace = record(disk_, {"migrate", data});
  const MapHash hash = hash_of(data);
  expect_kept(std::move(trace), how, [&](const LeftDisk& left) {
    const std::string own = left.root + "/map";
    const int found = storage::read_format(own).or_throw();
    promise(found == format || found == storage::kFolderFormat, "the map has format " + std::to_string(found));
    if (left.finished) promise(found != format, "the finished migration is lost");
    if (found == storage::kFolderFormat) promise_same(hash_of(own), hash, "the map before the second run");
    (void)storage::migrate_folder(own, {}).or_throw();
    promise_same(hash_of(own), hash, "the migrated map");
    promise(storage::read_format(own + ".format-" + number).or_throw() == format, "the former map is not kept");
    promise(!fs::exists(own + ".migrating"), "an unfinished migration is left");
    // Its words may be of another vocabulary than ours, so it is opened without a worker.
    auto engine = storage::open_rocksdb(own, small_engine()).or_throw();
    const std::uint64_t epoch = engine->acquire().or_throw();
    (void)storage::Map::open(std::move(engine), epoch, std::make_shared<storage::Budget>(std::size_t{64} << 20))
        .or_throw();
  });
}

void PowerFailure::reindex(const Thoroughness& how) {
  const std::string data = disk_ + "/map", file = folder_ / "other.vocab";
  make_map(data, {40, 30});
  const Bytes bytes = place::encode_vocabulary(place::random_vocabulary_model(500, 20, 5));
  std::ofstream(file, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  const auto other = place::Vocabulary::load(file).or_throw();
  const MapHash former = hash_of(data);
  Trace trace = record(disk_, {"reindex", data, "--vocabulary", file});
  const MapHash hash = hash_of(data);
  ASSERT_NE(hash, former);
  expect_kept(std::move(trace), how, [&](const LeftDisk& left) {
    const std::string own = left.root + "/map";
    const MapHash found = hash_of(own);
    promise(found.estimates == hash.estimates, "estimates have changed");
    if (left.finished) promise_same(found, hash, "the finished reindex");
    if (found != former && found != hash) {  // half way: every daemon refuses it, and says what to do
      const auto engine = storage::open_rocksdb(own, small_engine()).or_throw();
      const auto refused = map::Mapper::open(engine, std::make_shared<storage::Budget>(std::size_t{64} << 20),
                                             vocabulary(), map::MapperOptions());
      promise(refused.reason() == Reason::WRONG_VOCABULARY, "a map of two vocabularies is opened");
    }
    {
      const auto engine = storage::open_rocksdb(own, small_engine()).or_throw();
      const auto words = [&](std::span<const AppearanceFeature> features) { return other->words(features); };
      (void)storage::reindex(engine, words, other->crc(), {}, {}).or_throw();
    }
    promise_same(hash_of(own), hash, "the map after another reindex");
  });
}

void PowerFailure::deletion(const Thoroughness& how) {
  const std::string data = disk_ + "/map";
  make_map(data, {50, 70});
  const sim::PointsWorld kept(drive(50, 1));
  std::uint64_t deleted = 0;
  Trace trace{DiskModel(disk_), {}};
  {
    DiskModel again(disk_);
    const FileFaults faults(disk_, folder_ / "notes", Recording::kOn);
    DaemonOptions options{.data = data, .lcm = "", .more = {}};
    options.environment = faults.environment();
    RunningDaemon daemon(options);
    const auto client = daemon.client();
    throw_if(client->delete_session(2, client->sessions().or_throw().at(1).uuid, [](const auto&) { return true; }));
    deleted = faults.recorded();
    ASSERT_EQ(daemon.stop(), 0) << daemon.log();
    trace.operations = faults.operations();
    expect_complete(std::move(again), trace.operations, disk_);
  }
  std::size_t gone = 0;
  expect_kept(std::move(trace), how, [&](const LeftDisk& left) {
    const std::string own = left.root + "/map";
    if (left.number % 8 == 5) check_daemon(own, kept.size());
    const auto mapper = start_mapper(own);
    throw_if(mapper->wait_idle(steady_clock::now() + kPatience));
    promise_frames(*mapper->view(), kept, kept.size());
    std::uint64_t frames = 0;
    for (const storage::Session& session : mapper->view()->sessions())
      if (session.number == 2) frames = session.frames;
    gone += frames == 0;
    promise(frames == 0 || left.operations < deleted, "the deleted session is back");
    promise(frames == 0 || frames == 70, std::to_string(frames) + " frames of the deleted session are left");
    promise(map::derived_differences(*mapper->view()).empty(), "what is derived is wrong");
    throw_if(mapper->stop());
  });
  EXPECT_GT(gone, 0u);
}

constexpr Thoroughness kSample{12, 2}, kEach{0, 3};

TEST_F(PowerFailure, FirstStart) { first_start({30, 2}); }
TEST_F(PowerFailure, AfterASyncHasFailed) { failed_syncs(3, {16, 1}); }
TEST_F(PowerFailure, Backup) {
  Scene scene = backup();
  expect_kept(std::move(scene.trace), kSample, scene.check);
}
TEST_F(PowerFailure, Restore) { restore(kSample); }
TEST_F(PowerFailure, Repair) {
  Scene scene = repair();
  expect_kept(std::move(scene.trace), kSample, scene.check);
}
TEST_F(PowerFailure, MigrationFromFormat1) { migrate(1, kSample); }
TEST_F(PowerFailure, MigrationFromFormat2) { migrate(2, kSample); }
TEST_F(PowerFailure, Reindex) { reindex(kSample); }
TEST_F(PowerFailure, Deletion) { deletion(kSample); }

class LongPowerFailure : public PowerFailure {};

TEST_F(LongPowerFailure, FirstStart) { first_start(kEach); }
TEST_F(LongPowerFailure, Backup) {
  Scene scene = backup();
  expect_kept(std::move(scene.trace), kEach, scene.check);
}
TEST_F(LongPowerFailure, Restore) { restore(kEach); }
TEST_F(LongPowerFailure, MigrationFromFormat1) { migrate(1, kEach); }
TEST_F(LongPowerFailure, MigrationFromFormat2) { migrate(2, kEach); }
TEST_F(LongPowerFailure, Reindex) { reindex(kEach); }

// Those that take longest have a time limit of their own.
class LongPowerFailureRepair : public PowerFailure {};
TEST_F(LongPowerFailureRepair, Once) {
  Scene scene = repair();
  expect_kept(std::move(scene.trace), kEach, scene.check);
}
TEST_F(LongPowerFailureRepair, Again) { repair_again(4, {20, 2}); }

class LongPowerFailureDeletion : public PowerFailure {};
TEST_F(LongPowerFailureDeletion, EveryOperation) { deletion(kEach); }

class LongPowerFailureSync : public PowerFailure {};
TEST_F(LongPowerFailureSync, EverySync) { failed_syncs(0, {40, 2}); }

// That the checks see what they are there for.

TEST_F(PowerFailure, TheLossOfWhatWasAcknowledgedIsSeen) {
  const sim::PointsWorld world(drive(8, 1));
  FirstStart start = record_first_start(disk_, folder_ / "notes", world);
  for (FileOperation& operation : start.trace.operations)  // acknowledgements count operations
    if (operation.kind == OperationKind::kSync) operation.kind = OperationKind::kClose, operation.fd = -1;
  const SweepResult result =
      fail_power_during(std::move(start.trace.before), start.trace.operations, {10, 1}, [&](const LeftDisk& left) {
        check_first_start(left.root + "/srv/maps/map", world, acknowledged(start.told, left.operations));
      });
  EXPECT_THAT(result.summary(), HasSubstr("is lost"));
}

TEST_F(PowerFailure, TheLossOfAFinishedBackupIsSeen) {
  Scene scene = backup();
  std::vector<FileOperation>& operations = scene.trace.operations;
  // Those of the names, once the backup has its own.
  const auto named = std::find_if(operations.rbegin(), operations.rend(),
                                  [](const FileOperation& one) { return one.kind == OperationKind::kRename; });
  ASSERT_NE(named, operations.rend());
  const auto synced = std::remove_if(named.base(), operations.end(),
                                     [](const FileOperation& one) { return one.kind == OperationKind::kSync; });
  ASSERT_NE(synced, operations.end());
  operations.erase(synced, operations.end());
  const SweepResult result = fail_power_during(std::move(scene.trace.before), operations, {1, 0}, scene.check);
  EXPECT_THAT(result.summary(), HasSubstr("the finished backup is lost"));
}

}  // namespace
}  // namespace relmap::testing
