#include <filesystem>
#include <memory>

#include "proto/base/clock.h"
#include "storage/rocksdb/restore_folder.h"
#include "storage/rocksdb/rocksdb_engine.h"
#include "tools/relmap-admin/findings.h"
#include "tools/relmap-admin/target.h"

namespace relmap::admin {

namespace {

struct RestoreAsked {
  std::string backup, directory;
  bool no_verify = false;
};

// Verifies the backup. DATA_LOSS if it is damaged.
Status check_backup(const std::string& backup, const Context& context) {
  storage::RocksDbOptions options;
  options.read_only = true;
  const auto engine = storage::open_rocksdb(backup, options);
  if (!engine.ok()) return engine.status();
  const auto summary = verify_engine(context, backup, **engine, {});
  if (!summary.ok()) return summary.status();
  if (summary->findings == 0) return {};
  return Status(Reason::DATA_LOSS, backup + " is damaged (" + std::to_string(summary->findings) +
                                       " findings) and was not restored; `relmap-admin repair` may repair it, and "
                                       "--no-verify restores it as it is");
}

Answer restore(const RestoreAsked& asked, Context& context) {
  if (!context.server.empty()) throw CLI::ValidationError("restore works on folders, not on a daemon");
  if (Status free = check_free(asked.backup); !free.ok()) return {free, false, {}};
  if (std::filesystem::exists(asked.directory + "/FORMAT"))
    if (Status free = check_free(asked.directory); !free.ok()) return {free, false, {}};
  if (std::filesystem::exists(asked.directory) && !std::filesystem::is_empty(asked.directory))
    return {Status(Reason::INVALID_ARGUMENT, asked.directory + " is not empty: move it aside, or restore elsewhere"),
            false,
            {}};
  if (!asked.no_verify)
    if (Status sound = check_backup(asked.backup, context); !sound.ok())
      return {sound, sound.reason() == Reason::DATA_LOSS, {}};
  const auto restored = storage::restore_folder(asked.backup, asked.directory, static_cast<std::uint64_t>(now_us()),
                                                engine_progress(context, "restoring"));
  if (!restored.ok()) return {restored.status(), false, {}};
  context.say(asked.directory + ": restored, " + (asked.no_verify ? "without verification" : "after verification"));
  if (!restored->unmarked.ok())
    context.say("robots will not learn that the map was restored: " + restored->unmarked.to_string());
  Answer answer;
  answer.json.add("folder", asked.directory).add("verified", !asked.no_verify);
  add_map(answer.json, restored->map);
  return answer;
}

}  // namespace

void add_restore(CLI::App& app, Action& action) {
  auto* command =
      app.add_subcommand("restore", "make a data folder from a backup, which is verified first and not changed");
  auto asked = std::make_shared<RestoreAsked>();
  command->add_option("BACKUP", asked->backup, "folder made by `relmap-admin backup`")->type_name("FOLDER")->required();
  command->add_option("DIR", asked->directory, "data folder to create; it must be empty or not exist")
      ->type_name("FOLDER")
      ->required();
  command->add_flag("--no-verify", asked->no_verify, "copy the backup without verifying it");
  command->footer(R"(
A damaged backup is refused with exit code 3. The restored folder shares no files with the backup. Robots learn from its
daemon that the map was restored. They send again what they still have of the keyframes after the backup, and declare
the others as gaps. A folder that was copied by hand is taken for the map itself, and robots do neither.

Examples:
  relmap-admin restore /backup/map-monday /var/lib/relmap/map)");
  command->callback([&action, asked] { action = [asked](Context& context) { return restore(*asked, context); }; });
}

}  // namespace relmap::admin
