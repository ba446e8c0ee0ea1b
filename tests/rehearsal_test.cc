// Backups of which the newest are kept, drills of a restore, and rehearsed migrations: what they say, what they leave
// behind, and what they leave alone.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <thread>

#include "proto/base/crc32c.h"
#include "relmap/v1/status.pb.h"
#include "server/place/testing/random_vocabulary.h"
#include "storage/rocksdb/rocksdb_engine.h"
#include "storage/testing/temporary_folder.h"
#include "tests/paths.h"
#include "tests/support/generic_calls.h"
#include "tests/support/running_daemon.h"
#include "tools/relmap-admin/drill_questions.h"

namespace relmap::testing {
namespace {

namespace fs = std::filesystem;

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

constexpr int kFine = 0, kFailed = 1, kUsage = 2, kDamage = 3, kOwned = 4, kInterrupted = 130;

class RehearsalTest : public ::testing::Test {
 protected:
  struct Run {
    int exit_code = -1;
    nlohmann::json document;  // the last one
    std::string said;
    std::string reason() const { return document.value("reason", "(none)"); }
    std::string message() const { return document.value("message", "(none)"); }
  };
  static Run run_admin(std::vector<std::string> arguments, const std::vector<std::string>& environment = {}) {
    arguments.insert(arguments.begin(), {built_program("relmap-admin"), "--json", "-q"});
    const Finished done = run_program(arguments, kPatience, environment);
    Run run{done.exit_code, {}, done.standard_output + done.standard_error};
    std::istringstream lines(done.standard_output);
    for (std::string line; std::getline(lines, line);) run.document = nlohmann::json::parse(line);
    return run;
  }

  // A map of two laps, that no process owns.
  void make_map(const std::string& data, const std::string& seed = "1") const {
    const std::string drive = data + ".drive";
    ASSERT_EQ(run_program({built_program("relmap-sim"), "points", "--out", drive, "--frames", "120", "--frames-per-lap",
                           "80", "--appearance", "100", "--noise-seed", seed})
                  .exit_code,
              0);
    RunningDaemon daemon({.data = data, .lcm = "", .more = {}});
    const Finished streamed = run_program({built_program("relmap-frontend"), "--source", "sim", drive, "--robot",
                                           "walker", "--server", data, "--spool", "none", "--quiet"});
    ASSERT_EQ(streamed.exit_code, 0) << streamed.standard_error;
    ASSERT_TRUE(daemon.client()->wait_idle().ok());
    ASSERT_TRUE(daemon.client()->set_label({1, 7}, "dock").ok());
    ASSERT_EQ(daemon.stop(), 0) << daemon.log();
  }
  static std::string unpacked(const std::string& folder, int format) {
    fs::create_directory(folder);
    const std::string fixture = RELMAP_SOURCE_DIR "/tests/fixtures/map-format-" + std::to_string(format) + ".tar.xz";
    EXPECT_EQ(std::system(("tar -C " + folder + " -xJf " + fixture).c_str()), 0);
    return folder;
  }

  static std::vector<std::string> names(const std::string& folder) {
    std::vector<std::string> all;
    for (const auto& entry : fs::directory_iterator(folder)) all.push_back(entry.path().filename().string());
    std::sort(all.begin(), all.end());
    return all;
  }
  // Content and time of every file.
  static std::map<std::string, std::pair<std::uint32_t, fs::file_time_type>> files(const std::string& folder) {
    std::map<std::string, std::pair<std::uint32_t, fs::file_time_type>> all;
    for (const auto& entry : fs::recursive_directory_iterator(folder))
      if (entry.is_regular_file())
        all[entry.path().string()] = {crc32c(as_bytes(read_text(entry.path().string()))), entry.last_write_time()};
    return all;
  }
  static void flip(const std::string& file) {
    std::string bytes = read_text(file);
    bytes.at(bytes.size() / 2) ^= 0x10;
    std::ofstream(file, std::ios::binary) << bytes;
  }
  // The largest file of this kind.
  static std::string largest(const std::string& folder, const std::string& extension) {
    fs::path found;
    for (const auto& entry : fs::directory_iterator(folder + "/map"))
      if (entry.path().extension() == extension && (found.empty() || entry.file_size() > fs::file_size(found)))
        found = entry.path();
    return found.string();
  }

  const storage::TemporaryFolder folder_;
  const std::string map_ = folder_ / "map", backups_ = folder_ / "backups";
};

// ---- backup --keep

class KeptBackupsTest : public RehearsalTest {
 protected:
  std::string backup(const std::string& keep) const {
    const Run made = run_admin({"backup", map_, backups_, "--keep", keep});
    EXPECT_EQ(made.exit_code, kFine) << made.said;
    return fs::path(made.document.value("folder", "")).filename().string();
  }
};

TEST_F(KeptBackupsTest, TheOldestOfTheMapGoAndNothingElse) {
  make_map(map_);
  const std::string first = backup("2"), second = backup("2");
  ASSERT_THAT(first, ::testing::MatchesRegex("20..-..-..T..-..-..Z-[0-9a-f]{8}"));
  EXPECT_LT(first, second);
  const std::string digits = first.substr(first.size() - 8);

  // Beside them: another map's, links and files of such names, a backup that somebody renamed, and other folders.
  fs::create_directory(folder_ / "elsewhere");
  std::ofstream(folder_ / "elsewhere/precious") << "x";
  for (const std::string& name :
       {std::string("2001-01-01T00-00-00Z-00000000"), std::string("notes"), "keep-" + first}) {
    fs::create_directory(backups_ + "/" + name);
    std::ofstream(backups_ + "/" + name + "/FORMAT") << "relmap map 3\n";
  }
  fs::create_directory_symlink(folder_ / "elsewhere", backups_ + "/2001-01-01T00-00-01Z-" + digits);
  std::ofstream(backups_ + "/2001-01-01T00-00-02Z-" + digits) << "a file";
  fs::create_directory_symlink(folder_ / "elsewhere", backups_ + "/2001-01-01T00-00-03Z-" + digits + ".removed");
  fs::create_directory(backups_ + "/2001-01-01T00-00-04Z-" + digits + ".partial");
  std::ofstream(backups_ + "/2001-01-01T00-00-04Z-" + digits + ".partial/work") << "not of a backup";
  const std::vector<std::string> others = names(backups_);
  // And what interrupted ones left.
  const std::string partial = backups_ + "/2001-01-01T00-00-05Z-" + digits + ".partial";
  fs::create_directory(partial);
  std::ofstream(partial + "/PARTIAL") << "relmap partial folder 1\n";
  std::ofstream(partial + "/FORMAT") << "relmap map 3\n";
  fs::create_directory(backups_ + "/2001-01-01T00-00-06Z-" + digits + ".removed");
  std::ofstream(backups_ + "/2001-01-01T00-00-06Z-" + digits + ".removed/rest") << "x";

  const Run third = run_admin({"backup", map_, backups_, "--keep", "2"});
  ASSERT_EQ(third.exit_code, kFine) << third.said;
  EXPECT_THAT(third.document.at("removed"), ElementsAre(backups_ + "/" + first));
  std::vector<std::string> expected = others;
  std::erase(expected, first);
  expected.push_back(fs::path(third.document.value("folder", "")).filename());
  EXPECT_THAT(names(backups_), ::testing::UnorderedElementsAreArray(expected));
  EXPECT_EQ(read_text(folder_ / "elsewhere/precious"), "x");
  EXPECT_EQ(run_admin({"verify", backups_ + "/" + second}).exit_code, kFine);

  // A running daemon makes it, and another map's are not counted.
  make_map(folder_ / "other", "2");
  ASSERT_EQ(run_admin({"backup", folder_ / "other", backups_, "--keep", "1"}).document.at("removed").size(), 0u);
  RunningDaemon daemon({.data = map_, .lcm = "", .more = {"--backup-root", backups_}});
  for (const std::vector<std::string>& by : {std::vector<std::string>{"backup", map_, backups_, "--keep", "1"},
                                             {"--server", daemon.address(), "backup", backups_, "--keep", "1"}}) {
    const Run made = run_admin(by);
    EXPECT_EQ(made.exit_code, kFine) << made.said;
    EXPECT_THAT(made.document.at("removed"), Not(IsEmpty()));
  }
  EXPECT_EQ(daemon.stop(), 0) << daemon.log();
  EXPECT_THAT(names(backups_), SizeIs(others.size() - 2 + 2)) << "one of each map";
}

TEST_F(KeptBackupsTest, WhatCannotBeRemovedIsAFailureAfterTheBackup) {
  make_map(map_);
  const std::string first = backups_ + "/" + backup("1");
  const auto refused = [&] {
    const std::size_t before = names(backups_).size();
    const Run run = run_admin({"backup", map_, backups_, "--keep", "1"});
    EXPECT_EQ(run.exit_code, run.reason() == "FOLDER_LOCKED" ? kOwned
                             : run.reason() == "DATA_LOSS"   ? kDamage
                                                             : kFailed)
        << run.said;
    EXPECT_THAT(run.message(), HasSubstr("the backup is made, but " + first + " is not removed"));
    EXPECT_TRUE(fs::exists(first + "/FORMAT"));
    EXPECT_EQ(run_admin({"verify", run.document.value("folder", "")}).exit_code, kFine);
    EXPECT_LE(names(backups_).size(), before + 1);
    return run.reason();
  };
  {
    storage::RocksDbOptions reading;
    reading.read_only = true;
    const auto user = storage::open_rocksdb(first, reading).or_throw();
    EXPECT_EQ(refused(), "FOLDER_LOCKED");
  }
  {
    const auto engine = storage::open_rocksdb(first).or_throw();
    ASSERT_TRUE(engine->commit(engine->acquire().or_throw(), engine->applied_sequence(), {}, {}).ok());
  }
  EXPECT_EQ(refused(), "WRONG_STATE");
  fs::remove(first + "/HASH");
  fs::remove(first + "/map/CURRENT");
  EXPECT_EQ(refused(), "DATA_LOSS");
  fs::remove_all(first);
  make_map(folder_ / "other", "2");
  ASSERT_EQ(run_admin({"backup", folder_ / "other", first}).exit_code, kFine);
  EXPECT_EQ(refused(), "WRONG_MAP");
}

TEST_F(KeptBackupsTest, WhereOldOnesCannotBeRemovedNoBackupIsMade) {
  make_map(map_);
  EXPECT_EQ(run_admin({"backup", map_, backups_, "--keep", "0"}).exit_code, kUsage);
  fs::create_directory(backups_);
  ::chmod(backups_.c_str(), 0777);
  const Run open = run_admin({"backup", map_, backups_, "--keep", "1"});
  EXPECT_EQ(open.exit_code, kFailed) << open.said;
  EXPECT_EQ(open.reason(), "NOT_ALLOWED");

  // A daemon whose data folder is not on this machine.
  const GenericServer elsewhere(folder_ / "socket", [](const std::string&, const std::string&) {
    v1::GetStatusReply status;
    status.set_data_folder("/nowhere/map");
    status.set_boot_id("b007");
    status.set_map_uuid(SessionUuid::random().to_string());
    return std::optional(status.SerializeAsString());
  });
  const Run far = run_admin({"--server", "unix:" + folder_ / "socket", "backup", folder_ / "far", "--keep", "1"});
  EXPECT_EQ(far.exit_code, kFailed) << far.said;
  EXPECT_EQ(far.reason(), "UNSUPPORTED");
  EXPECT_THAT(names(backups_), IsEmpty());
}

TEST_F(KeptBackupsTest, KillsAndInterruptsLeaveNothingThatStays) {
  make_map(map_);
  for (int attempt = 0; attempt < 8; ++attempt) {
    Process backup({built_program("relmap-admin"), "backup", map_, backups_, "--keep", "2"}, {});
    std::this_thread::sleep_for(std::chrono::milliseconds(8 * attempt));
    backup.signal(attempt % 2 == 1 ? SIGKILL : SIGINT);
    (void)backup.wait(kPatience);
  }
  backup("2"), backup("2");
  const std::vector<std::string> left = names(backups_);
  EXPECT_THAT(left, SizeIs(2));
  for (const std::string& name : left) EXPECT_EQ(run_admin({"verify", backups_ + "/" + name}).exit_code, kFine) << name;
}

// ---- drill

class DrillTest : public RehearsalTest {
 protected:
  void SetUp() override {
    make_map(map_);
    ASSERT_EQ(run_admin({"backup", map_, backup_}).exit_code, kFine);
    fs::create_directory(scratch_);
  }
  Run drill(const std::string& backup, std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {"drill", backup, "--scratch", scratch_, "--questions", "30"});
    return run_admin(more);
  }
  // The same backup with one file changed.
  std::string spoiled(const std::function<void(const std::string&)>& spoil) const {
    const std::string copy = folder_ / "spoiled";
    fs::remove_all(copy);
    fs::copy(backup_, copy, fs::copy_options::recursive);
    spoil(copy);
    return copy;
  }

  const std::string backup_ = folder_ / "backup", scratch_ = folder_ / "scratch";
};

TEST_F(DrillTest, AGoodBackupPassesAndIsNotTouched) {
  const auto before = files(backup_);
  const Run run = drill(backup_, {"--seed", "7"});
  ASSERT_EQ(run.exit_code, kFine) << run.said;
  EXPECT_EQ(files(backup_), before);
  EXPECT_THAT(names(scratch_), IsEmpty());
  EXPECT_TRUE(run.document.at("passed"));
  EXPECT_TRUE(run.document.at("hash_recorded"));
  EXPECT_EQ(run.document.at("failed_step"), "");
  EXPECT_EQ(run.document.at("frames"), 120);
  const auto& asked = run.document.at("asked");
  EXPECT_EQ(asked.at("sessions"), 1);
  EXPECT_EQ(asked.at("frames"), 30);
  EXPECT_EQ(asked.at("places"), 30);
  EXPECT_GE(asked.at("transforms"), 29);
  EXPECT_GE(asked.at("routes"), 29);

  // The newest of kept ones, beside them; where that cannot be written to, in $TMPDIR.
  ASSERT_EQ(run_admin({"backup", map_, backups_, "--keep", "2"}).exit_code, kFine);
  const Run newest = run_admin({"drill", backups_, "--questions", "5"});
  EXPECT_EQ(newest.exit_code, kFine) << newest.said;
  EXPECT_EQ(newest.document.at("backup"), backups_ + "/" + names(backups_).back());
  EXPECT_THAT(names(backups_), SizeIs(1));

  const Run beside = run_admin({"drill", backup_, "--questions", "5", "--keep-scratch"});
  EXPECT_EQ(beside.exit_code, kFine) << beside.said;
  EXPECT_EQ(fs::path(std::string(beside.document.at("scratch"))).parent_path(), fs::canonical(backup_).parent_path());

  const Run kept = drill(backup_, {"--keep-scratch"});
  EXPECT_EQ(kept.exit_code, kFine) << kept.said;
  EXPECT_EQ(run_admin({"verify", std::string(kept.document.at("scratch")) + "/map"}).exit_code, kFine);
  EXPECT_EQ(drill(backup_).exit_code, kFine);
  EXPECT_THAT(names(scratch_), SizeIs(1)) << "it stays until somebody removes it";
}

TEST_F(DrillTest, DamageIsFoundAndNothingIsLeft) {
  const auto expect_found = [&](const std::string& what, const std::function<void(const std::string&)>& spoil) {
    const std::string backup = spoiled(spoil);
    const auto before = files(backup);
    const Run run = drill(backup);
    EXPECT_EQ(run.exit_code, kDamage) << what << run.said;
    EXPECT_FALSE(run.document.at("passed")) << what;
    EXPECT_THAT(run.message(), HasSubstr("the drill failed at '")) << what;
    EXPECT_EQ(files(backup), before) << what;
    EXPECT_THAT(names(scratch_), IsEmpty()) << what;
  };
  for (const char* kind : {".blob", ".sst"}) {
    expect_found(std::string("a bit of ") + kind, [&](const std::string& copy) { flip(largest(copy, kind)); });
    expect_found(std::string("no ") + kind, [&](const std::string& copy) { fs::remove(largest(copy, kind)); });
  }
  expect_found("a bit of HASH", [](const std::string& copy) { flip(copy + "/HASH"); });
  for (const char* file : {"/FORMAT", "/map/CURRENT"})
    expect_found(std::string("no ") + file, [&](const std::string& copy) { fs::remove(copy + file); });
  const auto remove_manifest = [](const std::string& copy) {
    for (const auto& entry : fs::directory_iterator(copy + "/map"))
      if (entry.path().filename().string().starts_with("MANIFEST")) fs::remove(entry.path());
  };
  expect_found("no MANIFEST", remove_manifest);
  expect_found("another map's HASH", [](const std::string& copy) {
    std::string line = read_text(copy + "/HASH");
    line.at(line.size() - 2) = line.at(line.size() - 2) == '0' ? '1' : '0';
    std::ofstream(copy + "/HASH") << line;
  });
}

TEST_F(DrillTest, WhatIsNoDamageFailsWithItsReason) {
  const std::string other = folder_ / "other.vocab";
  const Bytes bytes = place::encode_vocabulary(place::random_vocabulary_model(1000, 10, 5));
  std::ofstream(other, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  const Run vocabulary = drill(backup_, {"--vocabulary", other});
  EXPECT_EQ(vocabulary.exit_code, kFailed) << vocabulary.said;
  EXPECT_EQ(vocabulary.reason(), "WRONG_VOCABULARY");
  EXPECT_EQ(vocabulary.document.at("failed_step"), "start");
  const Run newer =
      drill(spoiled([](const std::string& copy) { std::ofstream(copy + "/FORMAT") << "relmap map 99\n"; }));
  EXPECT_EQ(newer.exit_code, kFailed) << newer.said;
  EXPECT_EQ(newer.reason(), "UNKNOWN_FORMAT_VERSION");
  const Run none = drill(folder_ / "nothing");
  EXPECT_EQ(none.exit_code, kFailed) << none.said;
  EXPECT_EQ(none.reason(), "NO_SUCH_FILE");
  {
    const auto owner = storage::open_rocksdb(backup_).or_throw();
    EXPECT_EQ(drill(backup_).exit_code, kOwned);
  }
  EXPECT_THAT(names(scratch_), IsEmpty());
}

TEST_F(DrillTest, ABackupOfAnOlderFormatIsMigratedInBetween) {
  const std::string old = unpacked(folder_ / "old", 2);
  const auto before = files(old);
  const Run run = drill(old);
  EXPECT_EQ(run.exit_code, kFine) << run.said;
  EXPECT_EQ(run.document.at("format"), 2);
  EXPECT_EQ(files(old), before);
  // That of format 1 has the words of a former vocabulary, which is said.
  const Run first = drill(unpacked(folder_ / "oldest", 1));
  EXPECT_EQ(first.reason(), "WRONG_VOCABULARY") << first.said;
  EXPECT_THAT(names(scratch_), IsEmpty());
}

TEST_F(DrillTest, AnInterruptedOneLeavesNothingAndAKilledOneIsCleanedUpByTheNext) {
  int interrupted = 0;
  for (int attempt = 0; attempt < 6; ++attempt) {
    Process drilling({built_program("relmap-admin"), "drill", backup_, "--scratch", scratch_},
                     {folder_ / "drill.out", folder_ / "drill.err"});
    std::this_thread::sleep_for(std::chrono::milliseconds(60 * attempt + 20));
    const bool hard = attempt % 3 == 2;
    drilling.signal(hard ? SIGKILL : SIGINT);
    const int code = drilling.wait(kPatience).value_or(-1);
    EXPECT_THAT(code, ::testing::AnyOf(kFine, kInterrupted, 128 + SIGINT, 128 + SIGKILL))
        << read_text(folder_ / "drill.err");
    interrupted += code == kInterrupted;
    if (code == kInterrupted) {
      EXPECT_THAT(names(scratch_), IsEmpty());
    }
  }
  EXPECT_GT(interrupted, 0);
  EXPECT_EQ(drill(backup_).exit_code, kFine);
  EXPECT_THAT(names(scratch_), IsEmpty());
}

// A drill that could not notice a wrong answer would be worth nothing: what is known is changed, one thing at a time.
TEST_F(DrillTest, EveryWrongAnswerIsNoticed) {
  const auto known = [&] {
    storage::RocksDbOptions reading;
    reading.read_only = true;
    return admin::read_known_map(storage::open_rocksdb(map_, reading).or_throw(), 8, 3).or_throw();
  };
  const admin::KnownMap right = known();
  ASSERT_THAT(right.sample, SizeIs(8));
  RunningDaemon daemon({.data = map_, .lcm = "", .more = {}});
  const auto client = daemon.client();
  const auto answer_to = [&](const std::function<void(admin::KnownMap&)>& change) {
    admin::KnownMap wrong = right;
    change(wrong);
    admin::QuestionCounts counts;
    return admin::ask_questions(
               *client, wrong, [](auto, auto) { return Status(); }, counts)
        .to_string();
  };
  EXPECT_EQ(answer_to([](auto&) {}), Status().to_string());
  const auto expect_noticed = [&](const char* what, const std::function<void(admin::KnownMap&)>& change) {
    EXPECT_THAT(answer_to(change), ::testing::AllOf(::testing::StartsWith("INTERNAL"), HasSubstr(what)));
  };
  expect_noticed("status, frames", [](auto& map) { ++map.frames; });
  expect_noticed("status, epoch", [](auto& map) { ++map.identity.epoch; });
  expect_noticed("status, accepted closures", [](auto& map) { ++map.closures_accepted; });
  expect_noticed("session 1, name", [](auto& map) { map.first_sessions.at(0).name = "another"; });
  expect_noticed("time", [](auto& map) { ++map.sample.at(2).time_us; });
  expect_noticed("labels", [](auto& map) { map.sample.at(2).labels.emplace_back("gate"); });
  expect_noticed("landmarks", [](auto& map) { ++map.sample.at(2).landmarks; });
  expect_noticed("transform from", [](auto& map) {
    for (admin::KnownEdge& edge : map.sample.at(2).neighbours) edge.T_ab.t.x() += 1e-3;
  });
  expect_noticed("route from", [](auto& map) {
    for (admin::KnownFrame& frame : map.sample) frame.metres_there *= 0.01;
  });
  expect_noticed("place of what", [](auto& map) { map.sample.at(0).features = map.sample.at(7).features; });
  EXPECT_EQ(daemon.stop(), 0) << daemon.log();
}

// ---- migrate --check

class MigrationCheckTest : public RehearsalTest {};

TEST_F(MigrationCheckTest, RehearsesAndChangesNothing) {
  for (const int format : {1, 2}) {
    const std::string old = unpacked(folder_ / ("old-" + std::to_string(format)), format);
    const auto before = files(old);
    const auto beside = names(folder_ / "");
    const Run run = run_admin({"migrate", old, "--check"});
    ASSERT_EQ(run.exit_code, kFine) << run.said;
    EXPECT_EQ(run.document.at("from"), format);
    EXPECT_EQ(run.document.at("to"), 3);
    EXPECT_EQ(run.document.at("frames"), format == 1 ? 90 : 137);
    EXPECT_GT(run.document.at("bytes"), 10000);
    EXPECT_EQ(run.document.at("findings"), 0);
    EXPECT_THAT(run.document.at("differences"), IsEmpty());
    EXPECT_EQ(files(old), before);
    EXPECT_EQ(names(folder_ / ""), beside);
    {
      storage::RocksDbOptions reading;
      reading.read_only = true;
      reading.format = format;
      const auto owner = storage::open_rocksdb(old, reading).or_throw();
      EXPECT_EQ(run_admin({"migrate", old, "--check"}).exit_code, kOwned);
    }
    EXPECT_EQ(run_admin({"migrate", old}).exit_code, kFine);
    const Run again = run_admin({"migrate", old, "--check"});
    EXPECT_EQ(again.exit_code, kFine) << again.said;
    EXPECT_EQ(again.document.at("from"), again.document.at("to"));
  }
}

TEST_F(MigrationCheckTest, FindsDamageBeforeTheMigrationDoes) {
  const std::string old = unpacked(folder_ / "old", 2);
  flip(largest(old, ".sst"));
  const auto before = files(old);
  const Run run = run_admin({"migrate", old, "--check"});
  EXPECT_EQ(run.exit_code, kDamage) << run.said;
  EXPECT_EQ(run.reason(), "DATA_LOSS");
  EXPECT_EQ(files(old), before);
  EXPECT_THAT(names(folder_ / ""), ElementsAre("old"));
}

TEST_F(MigrationCheckTest, ACurrentMapNeedsNoneAlsoWhileItIsServed) {
  make_map(map_);
  RunningDaemon daemon({.data = map_, .lcm = "", .more = {}});
  const Run run = run_admin({"migrate", map_, "--check"});
  EXPECT_EQ(run.exit_code, kFine) << run.said;
  EXPECT_EQ(run.document.at("from"), run.document.at("to"));
  EXPECT_EQ(daemon.stop(), 0) << daemon.log();
}

}  // namespace
}  // namespace relmap::testing
