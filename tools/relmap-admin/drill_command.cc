#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <memory>
#include <optional>
#include <thread>

#include "proto/base/clock.h"
#include "storage/io/disk_space.h"
#include "storage/io/file.h"
#include "storage/maintenance/stored_hash.h"
#include "storage/migrate/migrate.h"
#include "storage/rocksdb/folder.h"
#include "storage/rocksdb/map_files.h"
#include "storage/rocksdb/recorded_hash.h"
#include "storage/rocksdb/restore_folder.h"
#include "storage/rocksdb/rocksdb_engine.h"
#include "tools/relmap-admin/drill_daemon.h"
#include "tools/relmap-admin/drill_questions.h"
#include "tools/relmap-admin/findings.h"
#include "tools/relmap-admin/kept_backups.h"
#include "tools/relmap-admin/scratch_folder.h"
#include "tools/relmap-admin/target.h"

namespace relmap::admin {

namespace {

namespace fs = std::filesystem;

struct DrillAsked {
  std::string backup, scratch, vocabulary;
  std::size_t questions = 100;
  std::uint64_t seed = 1;
  bool keep_scratch = false;
};

// What a drill does and found. Each step returns how it ended; the first that fails ends the drill.
class Drill {
 public:
  Drill(const DrillAsked& asked, Context& context, const std::string& scratch)
      : asked_(asked), context_(context), map_(scratch + "/map"), log_(scratch + "/relmapd.log") {}

  Status run() {
    using Step = Status (Drill::*)();
    const std::pair<const char*, Step> steps[] = {{"restore", &Drill::restore}, {"hash", &Drill::compare_hash},
                                                  {"read", &Drill::read_known}, {"start", &Drill::start},
                                                  {"settle", &Drill::settle},   {"questions", &Drill::ask},
                                                  {"stop", &Drill::stop}};
    for (const auto& [name, step] : steps) {
      step_ = name;
      const Status done = (this->*step)();
      if (!done.ok()) return done;
    }
    step_.clear();
    return {};
  }

  const std::string& failed_step() const { return step_; }  // empty: the drill passed
  bool damage() const { return damage_; }
  const QuestionCounts& counts() const { return counts_; }
  std::uint64_t frames() const { return known_.frames; }
  int format() const { return format_; }
  bool hash_recorded() const { return hash_recorded_; }

 private:
  Status restore() {
    const auto format = storage::read_format(asked_.backup);
    if (!format.ok()) return damaged(format.status());
    format_ = *format;
    if (format_ == 0)  // a map whose FORMAT is gone, or no map at all
      return storage::check_folder(asked_.backup).ok() ? Status(Reason::NO_SUCH_FILE, asked_.backup + " holds no map")
                                                       : damaged(storage::check_folder(asked_.backup));
    if (Status known = storage::check_migratable(asked_.backup, format_); !known.ok()) return known;
    const bool older = format_ < storage::kFolderFormat;
    storage::CheckCopy check;
    if (!older) check = [this](const std::string& copy) { return check_copy(copy); };
    const auto restored =
        storage::restore_folder(asked_.backup, map_, static_cast<std::uint64_t>(now_us()), copy_progress(), check);
    if (!restored.ok()) return damaged(restored.status());
    if (older) return migrate();
    return damaged(restored->unmarked);
  }

  // As somebody would who restores a backup of an older format.
  Status migrate() {
    step_ = "migrate";
    const auto migrated = storage::migrate_folder(map_, [this](std::uint64_t done, std::uint64_t total) {
      context_.show("migrating", done, total, "frames");
      throw_if(check_interrupt());
    });
    if (!migrated.ok()) return damaged(migrated.status());
    fs::remove_all(migrated->kept);
    step_ = "verify";
    return check_copy(map_);
  }

  // Verifies a map, and notes its hash.
  Status check_copy(const std::string& copy) {
    step_ = "verify";
    const auto engine = open(copy);
    if (!engine.ok()) return damaged(engine.status());
    const auto recorded = storage::read_recorded_hash(copy);
    hash_recorded_ = recorded.ok() && recorded->has_value();
    const auto summary = verify_engine(context_, copy, **engine, {});
    if (!summary.ok()) return damaged(summary.status());
    if (summary->findings > 0)
      return damaged(Status(Reason::DATA_LOSS, asked_.backup +
                                                   " is damaged: " + counted_text(summary->findings, "finding") +
                                                   "; `relmap-admin verify` lists them"));
    return hash_of(**engine, hash_);
  }

  Status compare_hash() {
    const auto engine = open(map_);
    if (!engine.ok()) return damaged(engine.status());
    storage::MapHash restored;
    if (Status hashed = hash_of(**engine, restored); !hashed.ok()) return hashed;
    if (restored == hash_) return {};
    return damaged(
        Status(Reason::DATA_LOSS, "the restored map is another than that of the backup: their hashes differ"));
  }

  Status read_known() {
    context_.show("reading what is to be asked", 0, 0, "");
    const auto engine = open(map_);
    if (!engine.ok()) return damaged(engine.status());
    auto known = read_known_map(*engine, asked_.questions, asked_.seed);
    if (!known.ok()) return damaged(known.status());
    known_ = std::move(*known);
    return {};
  }

  Status start() {
    context_.show("starting relmapd", 0, 0, "");
    auto daemon = DrillDaemon::start(map_, log_, asked_.vocabulary, check_interrupt);
    if (daemon.reason() == Reason::WRONG_VOCABULARY)
      return {
          Reason::WRONG_VOCABULARY,
          "the words of the backup are of another vocabulary than the one that is shipped, or that --vocabulary names: "
          "give the one that its daemon has, or run `relmap-admin reindex` once it is restored"};
    if (!daemon.ok()) return damaged(daemon.status());
    daemon_ = std::move(*daemon);
    return {};
  }

  // Waits until the daemon has done what the map still had to do. If that has changed the map, what is known is read
  // again, and the daemon started again.
  Status settle() {
    for (Status idle(Reason::DEADLINE, ""); !idle.ok();) {
      const auto status = daemon_->client().status();
      if (!status.ok()) return status.status();
      if (!status->storage.ok()) return damaged(status->storage);
      const std::uint64_t left = status->queued + status->lookup_lag + status->pending_frames;
      context_.show("applying what the journal has", 0, left, "records and frames");
      if (Status going = check_interrupt(); !going.ok()) return going;
      if (left > 0)
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
      else if (idle = daemon_->client().wait_idle(); !idle.ok() && idle.reason() != Reason::DEADLINE)
        return idle;
    }
    const auto status = daemon_->client().status();
    if (!status.ok()) return status.status();
    if (status->durable_sequence == known_.applied_sequence) return {};
    if (status->frames < known_.frames)
      return {Reason::INTERNAL, "the daemon has " + counted_text(status->frames, "frame") +
                                    " after it applied the "
                                    "journal, the backup had " +
                                    std::to_string(known_.frames)};
    for (const auto next : {&Drill::stop, &Drill::read_known, &Drill::start})
      if (Status done = (this->*next)(); !done.ok()) return done;
    return {};
  }

  Status ask() {
    return ask_questions(
        daemon_->client(), known_,
        [this](std::uint64_t done, std::uint64_t total) {
          context_.show("asking", done, total, "frames");
          return check_interrupt();
        },
        counts_);
  }

  Status stop() {
    const Status ended = daemon_->stop();
    daemon_.reset();
    return ended;
  }

  // The status of a step that read the copy, about the backup: notes whether it means damage. What the copy lacks, the
  // backup lacks.
  Status damaged(const Status& status) {
    static constexpr Reason kDamage[] = {Reason::DATA_LOSS, Reason::CORRUPT, Reason::TRUNCATED,
                                         Reason::UNKNOWN_FORMAT_VERSION};
    for (const Reason reason : kDamage) damage_ = damage_ || status.reason() == reason;
    const bool lacks =
        status.reason() == Reason::IO_ERROR && status.message().find(std::strerror(ENOENT)) != std::string::npos;
    damage_ = damage_ || lacks;
    std::string message = status.message();
    for (const std::string& copy : {map_ + ".partial", map_})
      for (std::size_t at; (at = message.find(copy)) != std::string::npos;)
        message.replace(at, copy.size(), asked_.backup);
    return {lacks ? Reason::DATA_LOSS : status.reason(), message};
  }

  static Result<std::shared_ptr<storage::Engine>> open(const std::string& map) {
    storage::RocksDbOptions options;
    options.read_only = true;
    options.locked = true;  // nobody else knows of the copy
    return storage::open_rocksdb(map, options);
  }

  Status hash_of(const storage::Engine& engine, storage::MapHash& hash) {
    const auto found = storage::hash_stored(*engine.snapshot(), [this](std::uint64_t done, std::uint64_t total) {
      context_.show("hashing", done, total, "frames");
      return check_interrupt();
    });
    if (!found.ok()) return damaged(found.status());
    hash = *found;
    return {};
  }

  storage::EngineProgress copy_progress() { return engine_progress(context_, "restoring"); }

  const DrillAsked& asked_;
  Context& context_;
  const std::string map_, log_;
  std::string step_;
  bool damage_ = false;
  bool hash_recorded_ = false;
  int format_ = 0;
  storage::MapHash hash_;
  KnownMap known_;
  std::unique_ptr<DrillDaemon> daemon_;
  QuestionCounts counts_;
};

std::string scratch_parent(const DrillAsked& asked) {
  if (!asked.scratch.empty()) return asked.scratch;
  const std::string beside = parent_of(asked.backup);
  return ::access(beside.c_str(), W_OK | X_OK) == 0 ? beside : fs::temp_directory_path().string();
}

// Room for the copy, and for what a daemon makes beside it.
Status check_room(const DrillAsked& asked, const std::string& scratch) {
  std::uint64_t bytes = 0;
  for (const std::string& file : storage::files_of_map(asked.backup))
    if (std::error_code missing; fs::exists(asked.backup + "/" + file, missing))
      bytes += fs::file_size(asked.backup + "/" + file);
  const auto format = storage::read_format(asked.backup);
  const bool twice = format.ok() && *format < storage::kFolderFormat;  // the migration needs both
  const auto room = storage::posix_file_system()->room(scratch);
  if (!room.ok()) return room.status();
  // With less free than this a daemon takes the disk for full, and applies nothing (DiskSpaceOptions).
  const std::uint64_t low_water = std::min(storage::DiskSpaceOptions().low_water, room->size / 16);
  const std::uint64_t needed = bytes * (twice ? 2 : 1) + bytes / 8 + low_water * 3 / 2;
  if (room->free >= needed) return {};
  return {Reason::DISK_FULL, "the drill may need " + terminal::bytes_text(needed) + " in " +
                                 fs::path(scratch).parent_path().string() + ", " + terminal::bytes_text(room->free) +
                                 " are free; --scratch names another folder"};
}

Answer drill(DrillAsked asked, Context& context) {
  if (!context.server.empty()) throw CLI::ValidationError("drill works on a folder, not on a daemon");
  std::error_code error;
  const bool map = fs::exists(asked.backup + "/FORMAT", error) || fs::exists(asked.backup + "/map", error);
  if (!map && fs::is_directory(asked.backup, error)) {
    const auto newest = newest_backup(asked.backup);
    if (!newest.ok()) return {newest.status(), false, {}};
    asked.backup = *newest;
  } else if (!map) {
    return {Status(Reason::NO_SUCH_FILE, "there is no folder " + asked.backup), false, {}};
  }
  auto scratch = ScratchFolder::make(scratch_parent(asked));
  if (!scratch.ok()) return {scratch.status(), false, {}};
  Answer answer;
  std::string step = "room";
  QuestionCounts counts;
  std::uint64_t frames = 0;
  int format = 0;
  bool hash_recorded = false;
  answer.status = check_room(asked, (*scratch)->path());
  if (answer.status.ok()) {
    Drill drill(asked, context, (*scratch)->path());
    answer.status = drill.run();
    step = drill.failed_step();
    answer.damage = drill.damage();
    counts = drill.counts();
    frames = drill.frames();
    format = drill.format();
    hash_recorded = drill.hash_recorded();
  }
  const std::string kept = asked.keep_scratch ? (*scratch)->path() : "";
  if (asked.keep_scratch) {
    (*scratch)->keep();
    context.say("kept: " + kept);
  }
  if (answer.status.ok())
    context.say(asked.backup + ": passed; restored, verified and served: " + counted_text(frames, "frame") +
                ", asked " + counted_text(counts.sessions, "session") + ", " + counted_text(counts.frames, "frame") +
                ", " + counted_text(counts.transforms, "transform") + ", " + counted_text(counts.routes, "route") +
                ", " + counted_text(counts.places, "place") +
                (hash_recorded ? "" : "; no hash is recorded in it to compare with"));
  else
    answer.status = Status(answer.status.reason(), "the drill failed at '" + step + "': " + answer.status.message());
  answer.json.add("backup", asked.backup)
      .add("passed", answer.status.ok())
      .add("failed_step", step)
      .add("format", format)
      .add("hash_recorded", hash_recorded)
      .add("frames", frames)
      .add("asked", Json()
                        .add("sessions", counts.sessions)
                        .add("frames", counts.frames)
                        .add("transforms", counts.transforms)
                        .add("routes", counts.routes)
                        .add("places", counts.places))
      .add("seed", asked.seed)
      .add("scratch", kept);
  return answer;
}

}  // namespace

void add_drill(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand(
      "drill", "rehearse a restore: restore a backup elsewhere, serve it, ask it, and remove it; changes nothing");
  auto asked = std::make_shared<DrillAsked>();
  command
      ->add_option("BACKUP", asked->backup,
                   "folder made by `relmap-admin backup`, or a folder of those that --keep has made: the newest")
      ->required();
  command->add_option("--scratch", asked->scratch,
                      "folder in which to work; default: beside the backup, or $TMPDIR if that cannot be written to");
  command->add_option("--questions", asked->questions, "frames to ask about, chosen at random")
      ->check(CLI::Range(std::size_t{1}, std::size_t{1000000}))
      ->capture_default_str();
  command->add_option("--seed", asked->seed, "of that choice")->capture_default_str();
  command->add_option("--vocabulary", asked->vocabulary, "of the map, if it is not the one that is shipped")
      ->type_name("FILE");
  command->add_flag("--keep-scratch", asked->keep_scratch, "leave the restored map and its daemon's log for a look");
  command->footer(R"(
The backup is not written to at all. Its copy is verified and restored, the hash of the restored map compared with that of
the backup, and the relmapd beside this program started on it, reachable by nobody else. It is asked what the files say:
counts, sessions, frames, transforms between neighbours, routes within a session, and whether it recognises what
a frame saw as that place. A backup of an older format is migrated in between. Needs room for a copy of the map.

Exit codes:
  0  the backup can be restored, and serves
  1  something else failed, as the message says
  3  it is damaged

Examples:
  relmap-admin drill /backup/map-monday
  relmap-admin drill /backup --scratch /srv/scratch --questions 1000)");
  command->callback([&action, asked] { action = [asked](Context& context) { return drill(*asked, context); }; });
}

}  // namespace relmap::admin
