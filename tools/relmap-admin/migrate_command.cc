#include <memory>

#include "storage/migrate/migrate.h"
#include "storage/migrate/rehearsal.h"
#include "storage/rocksdb/rocksdb_engine.h"
#include "tools/relmap-admin/findings.h"
#include "tools/relmap-admin/scratch_folder.h"
#include "tools/relmap-admin/target.h"

namespace relmap::admin {

namespace {

struct MigrateAsked {
  std::string directory;
  bool check = false;
};

// Findings of the map that a rehearsal has made.
Result<std::uint64_t> verify_copy(const Context& context, const std::string& map) {
  storage::RocksDbOptions options;
  options.read_only = true;
  const auto engine = storage::open_rocksdb(map, options);
  if (!engine.ok()) return engine.status();
  const auto summary = verify_engine(context, map, **engine, {});
  if (!summary.ok()) return summary.status();
  return summary->findings;
}

Answer damage_or(const Status& status) { return {status, status.reason() == Reason::DATA_LOSS, {}}; }

// Beside the map, where the migration itself would work.
Answer check_migration(const std::string& directory, Context& context) {
  if (Status there = check_map(directory); !there.ok()) return {there, false, {}};
  const auto scratch = ScratchFolder::make(parent_of(directory));
  if (!scratch.ok()) return {scratch.status(), false, {}};
  const auto tried = storage::rehearse_migration(
      directory, (*scratch)->path(), [&](const char* step, std::uint64_t done, std::uint64_t total) {
        context.show(step, done, total, std::string(step) == "copying" ? "bytes" : "frames");
        return check_interrupt();
      });
  if (!tried.ok()) return damage_or(tried.status());
  const storage::MigrateSummary& migration = tried->migration;
  Answer answer;
  answer.json.add("from", static_cast<unsigned>(migration.from)).add("to", static_cast<unsigned>(migration.to));
  if (migration.from == migration.to) {
    context.say("the map is of format " + std::to_string(migration.to) + " already");
    return answer;
  }
  const auto findings = verify_copy(context, tried->map);
  if (!findings.ok()) return damage_or(findings.status());
  for (const std::string& difference : tried->differences) context.say("differs: " + difference);
  context.say("from format " + std::to_string(migration.from) + " to " + std::to_string(migration.to) + ": " +
              counted_text(migration.frames, "frame") + " in " + terminal::duration_text(tried->seconds) + ", " +
              terminal::bytes_text(tried->bytes) + " beside the map as it is, which was not changed");
  answer.json.add("frames", migration.frames)
      .add("seconds", tried->seconds)
      .add("bytes", tried->bytes)
      .add("findings", *findings)
      .add("differences", tried->differences);
  const std::uint64_t wrong = *findings + tried->differences.size();
  if (wrong == 0) return answer;
  answer.damage = true;
  answer.status = Status(Reason::DATA_LOSS, "the migrated map is not what it was: " + std::to_string(*findings) +
                                                " findings, " + std::to_string(tried->differences.size()) +
                                                " differences; do not migrate it, and keep the release that reads it");
  return answer;
}

Answer migrate_map(const std::string& directory, Context& context) {
  if (Status free = check_free(directory); !free.ok()) return {free, false, {}};
  const auto done = storage::migrate_folder(directory, [&](std::uint64_t frames, std::uint64_t total) {
    context.show("migrating", frames, total, "frames");
    if (Status stopped = check_interrupt(); !stopped.ok()) throw StatusError(stopped);
  });
  if (!done.ok()) return {done.status(), done.reason() == Reason::DATA_LOSS, {}};
  if (done->from == done->to)
    context.say("the map is of format " + std::to_string(done->to) + " already");
  else
    context.say("from format " + std::to_string(done->from) + " to " + std::to_string(done->to) + ": " +
                counted_text(done->frames, "frame") + "; the former map is kept in " + done->kept);
  Answer answer;
  answer.json.add("from", static_cast<unsigned>(done->from))
      .add("to", static_cast<unsigned>(done->to))
      .add("frames", done->frames)
      .add("kept", done->kept);
  return answer;
}

}  // namespace

void add_migrate(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("migrate", "convert a map of an older format to the current one");
  auto asked = std::make_shared<MigrateAsked>();
  command->add_option("DIR", asked->directory, "data folder; no daemon may own it")->type_name("FOLDER")->required();
  command->add_flag("--check", asked->check, "rehearse it on a copy, and change nothing in DIR");
  command->footer(R"(
The former map is kept beside the new one, so there must be room for both. Delete it when the new one works.

--check makes a copy beside DIR, which shares what it can with it, migrates and verifies that, compares it with DIR, and
removes it: it tells whether the migration succeeds, how long it takes and how much room. Exit code 3: the migrated map
would not be sound, or not the same.

Examples:
  relmap-admin migrate /var/lib/relmap/map --check
  relmap-admin migrate /var/lib/relmap/map)");
  command->callback([&action, asked] {
    action = [asked](Context& context) {
      if (!context.server.empty()) throw CLI::ValidationError("migrate works on a folder, not on a daemon");
      return asked->check ? check_migration(asked->directory, context) : migrate_map(asked->directory, context);
    };
  });
}

}  // namespace relmap::admin
