// relmap-admin on the folder of a running daemon, and on folders that no process owns.
#include <gmock/gmock.h>
#include <google/protobuf/struct.pb.h>
#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>

#include "server/map/derived.h"
#include "server/place/testing/random_vocabulary.h"
#include "storage/rocksdb/rocksdb_engine.h"
#include "storage/testing/temporary_folder.h"
#include "tests/paths.h"
#include "tests/support/running_daemon.h"
#include "tests/support/stored_map.h"

namespace relmap::testing {
namespace {

namespace fs = std::filesystem;

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr std::uint32_t kFrames = 400;
constexpr int kFine = 0, kFailed = 1, kUsage = 2, kDamage = 3, kOwned = 4, kUnreachable = 5, kInterrupted = 130;

// The last document of --json, which every run prints; each must be one.
google::protobuf::Struct last_document(const std::string& text) {
  google::protobuf::Struct document;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    document.Clear();
    EXPECT_TRUE(google::protobuf::util::JsonStringToMessage(line, &document).ok()) << line;
  }
  return document;
}
double number(const google::protobuf::Struct& document, const std::string& key) {
  EXPECT_TRUE(document.fields().contains(key)) << document.DebugString();
  return document.fields().contains(key) ? document.fields().at(key).number_value() : -1;
}
std::string text(const google::protobuf::Struct& document, const std::string& key) {
  return document.fields().contains(key) ? document.fields().at(key).string_value() : "(none)";
}

class Admin : public ::testing::Test {
 protected:
  static Finished admin(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), built_program("relmap-admin"));
    return run_program(arguments);
  }
  static std::string said(const Finished& run) { return run.standard_output + run.standard_error; }

  void record_drive() {
    ASSERT_EQ(run_program({built_program("relmap-sim"), "points", "--out", drive_, "--frames", std::to_string(kFrames),
                           "--frames-per-lap", "250", "--appearance", "100"})
                  .exit_code,
              0);
  }
  Process stream(const DaemonOptions& options, int rate_hz) {
    return Process({built_program("relmap-frontend"), "--source", "sim", drive_, "--robot", "walker", "--lcm",
                    options.lcm, "--spool", folder_ / "spool", "--rate", std::to_string(rate_hz), "--quiet"},
                   {folder_ / "frontend.out", folder_ / "frontend.err"});
  }
  // Maps the drive; no process owns the folder afterwards.
  void make_map() {
    record_drive();
    RunningDaemon daemon(options_);
    Process frontend = stream(options_, 2000);
    ASSERT_EQ(frontend.wait(kPatience), 0) << read_text(folder_ / "frontend.err");
    ASSERT_TRUE(daemon.client()->wait_idle().ok());
    ASSERT_EQ(daemon.stop(), 0) << daemon.log();
  }
  // A byte in the middle of the largest file of the map's values.
  static void damage(const std::string& data) {
    fs::path largest;
    for (const auto& entry : fs::directory_iterator(data + "/map"))
      if (const auto kind = entry.path().extension(); kind == ".blob" || kind == ".sst")
        if (largest.empty() || entry.file_size() > fs::file_size(largest)) largest = entry.path();
    ASSERT_FALSE(largest.empty());
    const auto middle = static_cast<std::streamoff>(fs::file_size(largest) / 2);
    std::fstream file(largest, std::ios::in | std::ios::out | std::ios::binary);
    file.seekg(middle);
    const int byte = file.get();
    file.seekp(middle);
    file.put(static_cast<char>(byte ^ 0x55));
  }

  const storage::TemporaryFolder folder_;
  const std::string drive_ = folder_ / "drive";
  const DaemonOptions options_{
      .data = folder_ / "map", .lcm = random_lcm_url(), .more = {"--backup-root", folder_ / ""}};
};

TEST_F(Admin, ABackupMadeWhileKeyframesStreamInHasAllThatWasAcknowledged) {
  record_drive();
  const std::string copy = folder_ / "copy", later = folder_ / "later", back = folder_ / "back";
  {
    RunningDaemon daemon(options_);
    Process frontend = stream(options_, 100);
    const auto client = daemon.client();
    client::DaemonStatus before;
    while ((before = client->status().or_throw()).frames < kFrames / 4)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));

    const Finished backed_up = admin({"--json", "backup", options_.data, copy});
    ASSERT_EQ(backed_up.exit_code, kFine) << said(backed_up);
    EXPECT_THAT(backed_up.standard_error, HasSubstr("unix:" + options_.data + "/socket"));
    const auto document = last_document(backed_up.standard_output);
    EXPECT_EQ(text(document, "reason"), "OK");
    EXPECT_GE(number(document, "durable_sequence"), static_cast<double>(before.durable_sequence));
    EXPECT_FALSE(fs::exists(copy + ".partial"));
    ASSERT_TRUE(frontend.running()) << "nothing came in during the backup";

    EXPECT_GE(client->commit().or_throw(), before.applied_sequence);
    const Finished verified = admin({"--json", "verify", options_.data});  // by the daemon, at work
    EXPECT_EQ(verified.exit_code, kFine) << said(verified);
    EXPECT_GE(number(last_document(verified.standard_output), "frames"), kFrames / 4.0);
    EXPECT_EQ(admin({"verify", copy}).exit_code, kFine);
    const Finished restored = admin({"restore", copy, back});
    ASSERT_EQ(restored.exit_code, kFine) << said(restored);

    // The copy is a map like any other, with every keyframe that had been acknowledged.
    {
      RunningDaemon second({.data = back, .lcm = "", .more = {}});
      ASSERT_TRUE(second.client()->wait_idle().ok()) << second.log();
      EXPECT_GE(second.client()->status().or_throw().frames, before.frames);
      EXPECT_EQ(second.stop(), 0) << second.log();
      const auto map = open_stored_map(back);
      auto keyframes = read_keyframes(drive_ + "/keyframes.bin");
      keyframes.resize(map->state().keyframes);
      EXPECT_THAT(settled_once_differences(*map, keyframes), IsEmpty());
      EXPECT_THAT(map::derived_differences(*map), IsEmpty());
    }

    ASSERT_EQ(frontend.wait(kPatience), 0);
    ASSERT_TRUE(client->wait_idle().ok());
    const Finished again = admin({"--server", daemon.address(), "backup", later});
    ASSERT_EQ(again.exit_code, kFine) << said(again);
    EXPECT_EQ(daemon.stop(), 0) << daemon.log();
  }
  // A backup of a map at rest is that map, bit for bit.
  EXPECT_EQ(storage::hash_map(*open_stored_map(later)), storage::hash_map(*open_stored_map(options_.data)));
}

TEST_F(Admin, RepairAndRestoreNeedTheDaemonStopped) {
  record_drive();
  RunningDaemon daemon(options_);
  const Finished repair = admin({"--json", "repair", options_.data});
  EXPECT_EQ(repair.exit_code, kOwned) << said(repair);
  EXPECT_EQ(text(last_document(repair.standard_output), "reason"), "FOLDER_LOCKED");
  EXPECT_THAT(repair.standard_error, HasSubstr("unix:" + options_.data + "/socket"));
  ASSERT_EQ(admin({"backup", options_.data, folder_ / "copy"}).exit_code, kFine);
  const Finished restore = admin({"--json", "restore", folder_ / "copy", options_.data});
  EXPECT_EQ(restore.exit_code, kOwned) << said(restore);
  EXPECT_EQ(text(last_document(restore.standard_output), "reason"), "FOLDER_LOCKED");
  EXPECT_THAT(restore.standard_error, HasSubstr("unix:" + options_.data + "/socket"));
  EXPECT_EQ(admin({"restore", options_.data, folder_ / "elsewhere"}).exit_code, kOwned);
  EXPECT_EQ(admin({"--server", daemon.address(), "repair"}).exit_code, kOwned);
  EXPECT_EQ(admin({"--server", daemon.address(), "stats"}).exit_code, kFine);
  EXPECT_EQ(admin({"--server", daemon.address(), "backup", "relative"}).exit_code, kFailed);
  EXPECT_EQ(daemon.stop(), 0) << daemon.log();
}

TEST_F(Admin, ABackupIntoTheMapsOwnFolderIsRefusedByTheDaemonAndWithoutOne) {
  record_drive();
  const auto expect_refused = [&](const std::string& to) {
    const Finished refused = admin({"--json", "backup", options_.data, to});
    EXPECT_EQ(refused.exit_code, kFailed) << to << said(refused);
    EXPECT_EQ(text(last_document(refused.standard_output), "reason"), "INVALID_ARGUMENT");
    for (const auto& entry : fs::recursive_directory_iterator(options_.data))
      EXPECT_THAT(entry.path().string(), ::testing::Not(HasSubstr("backup"))) << to;
  };
  const auto expect_all_refused = [&] {
    for (const std::string& to :
         {options_.data, options_.data + "/backup", options_.data + "/map/../backup", folder_ / "link/backup",
          folder_ / ".", fs::relative(options_.data + "/backup").string()})
      expect_refused(to);
  };
  fs::create_directory_symlink(options_.data, folder_ / "link");
  {
    RunningDaemon daemon(options_);
    expect_all_refused();
    EXPECT_EQ(daemon.stop(), 0) << daemon.log();
  }
  expect_all_refused();
  ASSERT_EQ(admin({"backup", options_.data, folder_ / "copy"}).exit_code, kFine);
  EXPECT_EQ(admin({"restore", folder_ / "copy", folder_ / "copy/map/again"}).exit_code, kFailed);
  EXPECT_FALSE(fs::exists(folder_ / "copy/map/again.partial"));
  EXPECT_EQ(admin({"verify", folder_ / "copy"}).exit_code, kFine);
}

// A backup records the hash of its map; a sound map with another hash is not restored in its place.
TEST_F(Admin, ABackupIsComparedWithItsRecordedHash) {
  make_map();
  const std::string copy = folder_ / "copy", back = folder_ / "back";
  ASSERT_EQ(admin({"backup", options_.data, copy}).exit_code, kFine);
  std::string line;
  std::getline(std::ifstream(copy + "/HASH"), line);
  ASSERT_THAT(line, ::testing::StartsWith("relmap hash 1 commit "));
  EXPECT_EQ(admin({"verify", copy}).exit_code, kFine);
  std::string other = line;
  other.back() = other.back() == '0' ? '1' : '0';
  std::ofstream(copy + "/HASH") << other << '\n';
  const Finished refused = admin({"--json", "restore", copy, back});
  EXPECT_EQ(refused.exit_code, kDamage) << said(refused);
  EXPECT_THAT(refused.standard_output, HasSubstr("is not the one of which"));
  EXPECT_FALSE(fs::exists(back));
  std::ofstream(copy + "/HASH") << line << '\n';
  ASSERT_EQ(admin({"restore", copy, back}).exit_code, kFine);

  // The restored map is written to, after which the hash no longer counts.
  std::getline(std::ifstream(back + "/HASH"), line);  // of the commit that says it was restored
  other = line;
  other.back() = other.back() == '0' ? '1' : '0';
  EXPECT_EQ(admin({"verify", back}).exit_code, kFine);
  std::ofstream(back + "/HASH") << other << '\n';
  EXPECT_EQ(admin({"verify", back}).exit_code, kDamage);
  {
    const auto engine = storage::open_rocksdb(back).or_throw();
    ASSERT_TRUE(engine->commit(engine->acquire().or_throw(), engine->applied_sequence(), {}, {}).ok());
  }
  EXPECT_EQ(admin({"verify", back}).exit_code, kFine);
}

TEST_F(Admin, ADamagedBackupIsNotRestored) {
  make_map();
  const std::string copy = folder_ / "copy", back = folder_ / "back", twin = folder_ / "twin";
  ASSERT_EQ(admin({"backup", options_.data, copy}).exit_code, kFine);
  ASSERT_EQ(admin({"restore", copy, twin}).exit_code, kFine);
  damage(twin);
  const Finished verified = admin({"--json", "verify", twin});
  EXPECT_EQ(verified.exit_code, kDamage) << said(verified);
  EXPECT_THAT(verified.standard_output, HasSubstr(R"({"finding":{)"));
  EXPECT_EQ(text(last_document(verified.standard_output), "reason"), "DATA_LOSS");
  const Finished refused = admin({"--json", "restore", twin, back});
  EXPECT_EQ(refused.exit_code, kDamage) << said(refused);
  EXPECT_EQ(text(last_document(refused.standard_output), "reason"), "DATA_LOSS");
  EXPECT_FALSE(fs::exists(back));
  EXPECT_EQ(admin({"restore", "--no-verify", twin, back}).exit_code, kFine);
  EXPECT_EQ(admin({"restore", copy, back}).exit_code, kFailed) << "onto a folder that is not empty";

  // The restored copy shares nothing with what it came from.
  EXPECT_EQ(admin({"verify", copy}).exit_code, kFine);
  EXPECT_EQ(admin({"verify", options_.data}).exit_code, kFine);
  const Finished repaired = admin({"--json", "repair", back});
  EXPECT_EQ(repaired.exit_code, kDamage) << said(repaired);
  EXPECT_EQ(admin({"verify", back}).exit_code, kFine);
  EXPECT_EQ(admin({"repair", options_.data}).exit_code, kFine) << "nothing to mend";
}

TEST_F(Admin, CompactionAndStatsOfAMapAtRest) {
  make_map();
  const storage::MapHash hash = storage::hash_map(*open_stored_map(options_.data));
  const auto before = last_document(admin({"--json", "stats", options_.data}).standard_output);
  EXPECT_EQ(number(before, "frames"), kFrames);
  EXPECT_EQ(number(before, "sessions"), 1);
  EXPECT_GE(number(before, "durable_sequence"), kFrames + 1);
  EXPECT_GT(number(before, "map_bytes"), kFrames * 2000.0);
  const Finished compacted = admin({"--json", "compact", options_.data});
  ASSERT_EQ(compacted.exit_code, kFine) << said(compacted);
  const auto document = last_document(compacted.standard_output);
  constexpr double kOwnLogs = 65536;  // RocksDB's, of what was done
  EXPECT_LT(number(document, "bytes_after"), number(document, "bytes_before") + kOwnLogs);
  const auto after = last_document(admin({"--json", "stats", options_.data}).standard_output);
  EXPECT_EQ(number(after, "garbage_bytes"), 0);
  EXPECT_LT(number(after, "map_bytes"), number(before, "map_bytes") + kOwnLogs);
  EXPECT_EQ(storage::hash_map(*open_stored_map(options_.data)), hash);
  const std::string told = admin({"stats", options_.data}).standard_output;
  EXPECT_THAT(told, HasSubstr("1 session, 400 frames"));
  EXPECT_THAT(told, Not(HasSubstr("rocksdb."))) << "numbers without units, for --json";
}

// Keys of a later version are copied with the map, whether their values are small or in a blob file.
TEST_F(Admin, BackupRestoreAndCompactKeepKeysOfALaterVersion) {
  make_map();
  const std::vector<storage::Put> later{{"x", {1}}, {"zone/1", Bytes(50000, 2)}, {std::string("\xff\0", 2), {3}}};
  {
    const auto engine = storage::open_rocksdb(options_.data).or_throw();
    const auto epoch = engine->acquire().or_throw();
    // Replaced once, so that compaction has something to drop beside what it must keep.
    std::vector<storage::Put> before = later;
    before[1].value = Bytes(60000, 4);
    for (const std::vector<storage::Put>& puts : {before, later})
      ASSERT_TRUE(engine->commit(epoch, engine->applied_sequence(), puts, {}).ok());
  }
  const auto expect_kept = [&](const std::string& data) {
    storage::RocksDbOptions options;
    options.read_only = true;
    const auto snapshot = storage::open_rocksdb(data, options).or_throw()->snapshot();
    for (const storage::Put& put : later)
      EXPECT_EQ(snapshot->get(put.key).value(), put.value) << data << ": " << put.key;
  };
  const std::string copy = folder_ / "copy", back = folder_ / "back", again = folder_ / "again";
  ASSERT_EQ(admin({"backup", options_.data, copy}).exit_code, kFine);
  expect_kept(copy);
  ASSERT_EQ(admin({"restore", copy, back}).exit_code, kFine);
  expect_kept(back);
  const Finished compacted = admin({"compact", back});
  ASSERT_EQ(compacted.exit_code, kFine) << said(compacted);
  expect_kept(back);

  // And where a daemon that does not know them does it.
  RunningDaemon daemon(options_);
  const Finished beside = admin({"compact", options_.data});
  ASSERT_EQ(beside.exit_code, kFine) << said(beside);
  EXPECT_THAT(beside.standard_error, HasSubstr("unix:" + options_.data + "/socket"));
  ASSERT_EQ(admin({"backup", options_.data, again}).exit_code, kFine);
  EXPECT_EQ(daemon.stop(), 0) << daemon.log();
  expect_kept(options_.data);
  expect_kept(again);
}

TEST_F(Admin, AnInterruptedBackupIsNeverMistakenForACompleteOne) {
  make_map();
  int interrupted = 0;
  for (int attempt = 0; attempt < 8; ++attempt) {
    const std::string copy = folder_ / ("copy" + std::to_string(attempt));
    Process backup({built_program("relmap-admin"), "backup", options_.data, copy},
                   {folder_ / "admin.out", folder_ / "admin.err"});
    std::this_thread::sleep_for(std::chrono::milliseconds(5 * attempt));
    const bool hard = attempt % 2 == 1;
    backup.signal(hard ? SIGKILL : SIGINT);
    const int code = backup.wait(kPatience).value_or(-1);
    EXPECT_THAT(code, ::testing::AnyOf(kFine, kInterrupted, 128 + SIGKILL)) << read_text(folder_ / "admin.err");
    interrupted += code != kFine;
    if (!hard) {
      EXPECT_FALSE(fs::exists(copy + ".partial"));
      EXPECT_EQ(fs::exists(copy), code == kFine);
    }
    if (fs::exists(copy)) {
      EXPECT_EQ(admin({"verify", copy}).exit_code, kFine);
    } else {
      EXPECT_EQ(admin({"backup", options_.data, copy}).exit_code, kFine) << "what was left is in the way";
    }
  }
  EXPECT_GT(interrupted, 0);
}

TEST_F(Admin, AMapOfAnOlderFormatIsRefusedByNameAndMigrated) {
  for (const int format : {1, 2}) {
    const std::string number_of = std::to_string(format), old = folder_ / ("old-" + number_of);
    fs::create_directory(old);
    const std::string fixture = RELMAP_SOURCE_DIR "/tests/fixtures/map-format-" + number_of + ".tar.xz";
    ASSERT_EQ(std::system(("tar -C " + old + " -xJf " + fixture).c_str()), 0);
    const Finished refused = admin({"--json", "verify", old});
    EXPECT_EQ(refused.exit_code, kFailed) << said(refused);
    EXPECT_EQ(text(last_document(refused.standard_output), "reason"), "UNKNOWN_FORMAT_VERSION");
    const Finished migrated = admin({"--json", "migrate", old});
    ASSERT_EQ(migrated.exit_code, kFine) << said(migrated);
    const auto document = last_document(migrated.standard_output);
    EXPECT_EQ(number(document, "from"), format);
    EXPECT_EQ(number(document, "frames"), format == 1 ? 90 : 137);
    EXPECT_TRUE(fs::exists(text(document, "kept"))) << text(document, "kept");
    EXPECT_EQ(admin({"verify", old}).exit_code, kFine);
    EXPECT_THAT(admin({"migrate", old}).standard_output, HasSubstr("already"));
  }
}

// While the words are of two vocabularies, daemons refuse the map; afterwards places are recognised with the new one.
TEST_F(Admin, ReindexCompletesAfterAKillHalfWay) {
  make_map();
  const storage::MapHash hash = storage::hash_map(*open_stored_map(options_.data));
  const std::string other = folder_ / "other.vocab";
  {
    const Bytes bytes =
        place::encode_vocabulary(place::random_vocabulary_model(10000, 20, 5));  // slow enough to be killed at it
    std::ofstream(other, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }
  DaemonOptions with_other = options_;
  with_other.more = {"--vocabulary", other};
  const auto expect_refused = [&](const DaemonOptions& options, const std::string& advice) {
    const Finished refused = run_program(daemon_arguments(options));
    EXPECT_EQ(refused.exit_code, 6);
    EXPECT_THAT(refused.standard_error, HasSubstr("WRONG_VOCABULARY"));
    EXPECT_THAT(refused.standard_error, HasSubstr("relmap-admin reindex " + options_.data + advice));
  };
  expect_refused(with_other, " --vocabulary " + other);

  const auto killed_half_way = [&] {
    Process reindex({built_program("relmap-admin"), "reindex", options_.data, "--vocabulary", other},
                    {folder_ / "admin.out", folder_ / "admin.err"});
    while (reindex.running() && read_text(folder_ / "admin.err").find("words") == std::string::npos)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    reindex.kill();
    return reindex.wait(kPatience) == 128 + SIGKILL;
  };
  int attempts = 0;  // it may be done before the kill comes
  while (!killed_half_way()) {
    ASSERT_LT(++attempts, 10) << read_text(folder_ / "admin.err");
    ASSERT_EQ(admin({"reindex", options_.data}).exit_code, kFine);
  }
  expect_refused(options_, "");
  expect_refused(with_other, " --vocabulary " + other);
  EXPECT_EQ(admin({"verify", options_.data}).exit_code, kFine);

  // Reindexed with the first vocabulary, the map is the same as before.
  const Finished back = admin({"reindex", options_.data});
  ASSERT_EQ(back.exit_code, kFine) << said(back);
  EXPECT_EQ(storage::hash_map(*open_stored_map(options_.data)), hash);

  const Finished done = admin({"--json", "reindex", options_.data, "--vocabulary", other});
  ASSERT_EQ(done.exit_code, kFine) << said(done);
  const auto document = last_document(done.standard_output);
  EXPECT_EQ(number(document, "with_words"), kFrames);
  EXPECT_EQ(number(document, "without_appearance"), 0);
  EXPECT_EQ(text(document, "reason"), "OK");
  EXPECT_EQ(storage::hash_map(*open_stored_map(options_.data)).estimates, hash.estimates);
  EXPECT_EQ(admin({"verify", options_.data}).exit_code, kFine);
  expect_refused(options_, "");
  const Finished again = admin({"reindex", options_.data, "--vocabulary", other});
  EXPECT_EQ(again.exit_code, kFine) << said(again);
  EXPECT_THAT(again.standard_output, HasSubstr("already"));

  RunningDaemon daemon(with_other);
  ASSERT_TRUE(daemon.client()->wait_idle().ok()) << daemon.log();
  EXPECT_EQ(daemon.client()->status().or_throw().places, kFrames) << daemon.log();
  constexpr FrameId kAsks{1, 320};  // on the second lap of 250 frames
  const auto matches = daemon.client()->match_image({.left = "", .right = "", .camera = {}, .frame = kAsks}).or_throw();
  ASSERT_FALSE(matches.places.empty());
  EXPECT_NE(matches.places.front().verification, client::Verification::kNone);
  EXPECT_NEAR(matches.places.front().frame.index, kAsks.index - 250, 6);
  const Finished owned = admin({"--json", "reindex", options_.data});
  EXPECT_EQ(owned.exit_code, kOwned) << said(owned);
  EXPECT_EQ(text(last_document(owned.standard_output), "reason"), "FOLDER_LOCKED");
  EXPECT_THAT(owned.standard_error, HasSubstr("unix:" + options_.data + "/socket"));
  EXPECT_EQ(admin({"--server", daemon.address(), "reindex"}).exit_code, kOwned);
  EXPECT_EQ(daemon.stop(), 0) << daemon.log();
}

TEST_F(Admin, AnInvalidVocabularyIsRefusedByNameWithoutAnyChange) {
  make_map();
  const std::string none = folder_ / "none.vocab";
  const auto reason = [&] {
    const Finished run = admin({"--json", "reindex", options_.data, "--vocabulary", none});
    EXPECT_EQ(run.exit_code, kFailed) << said(run);
    EXPECT_THAT(run.standard_error, HasSubstr(none));
    return text(last_document(run.standard_output), "reason");
  };
  EXPECT_EQ(reason(), "NO_SUCH_FILE");
  std::ofstream(none) << std::string(5000, 'x');
  EXPECT_EQ(reason(), "CORRUPT");
  RunningDaemon daemon(options_);  // of the vocabulary that the map has
  EXPECT_EQ(daemon.stop(), 0) << daemon.log();
}

TEST_F(Admin, WrongUsageAndMissingMapsAreToldApart) {
  EXPECT_EQ(admin({"--help"}).exit_code, kFine);
  for (const std::vector<std::string>& wrong : std::vector<std::vector<std::string>>{
           {}, {"fly"}, {"verify"}, {"backup", "one"}, {"restore", "one"}, {"verify", "a", "--server", "localhost:1"}})
    EXPECT_EQ(admin(wrong).exit_code, kUsage) << (wrong.empty() ? "" : wrong.front());
  for (const char* command : {"verify", "repair", "compact", "migrate", "reindex", "stats"}) {
    const Finished missing = admin({"--json", command, folder_ / "nothing"});
    EXPECT_EQ(missing.exit_code, kFailed) << command << said(missing);
    EXPECT_EQ(text(last_document(missing.standard_output), "reason"), "NO_SUCH_FILE");
    EXPECT_FALSE(fs::exists(folder_ / "nothing"));
  }
  EXPECT_EQ(admin({"--server", "localhost:1", "stats"}).exit_code, kUnreachable);
}

}  // namespace
}  // namespace relmap::testing
