#include <filesystem>
#include <memory>
#include <optional>

#include "client/server_address.h"
#include "proto/base/clock.h"
#include "storage/format/keys.h"
#include "storage/format/state_codec.h"
#include "tools/relmap-admin/kept_backups.h"
#include "tools/relmap-admin/target.h"

namespace relmap::admin {

namespace {

struct BackupAsked {
  std::string first, second;
  std::size_t keep = 0;  // 0: the folder is the backup itself
};

std::uint64_t bytes_in(const std::string& folder) {
  std::uint64_t sum = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
    if (entry.is_regular_file()) sum += entry.file_size();
  return sum;
}

Result<client::Backup> back_up(const Context& context, storage::Engine& engine, const std::string& folder) {
  const std::uint64_t durable = engine.last_journal_sequence();
  if (Status made = engine.checkpoint(folder, engine_progress(context, "backing up")); !made.ok()) return made;
  return client::Backup{folder, bytes_in(folder), durable};
}

Result<client::Backup> back_up(const Context& context, const Target& target, const std::string& folder) {
  return target.daemon ? target.daemon->backup(folder, daemon_progress(context))
                       : back_up(context, *target.engine, folder);
}

// The map's uuid, by which its backups are told from those of other maps.
Result<Uuid> map_of(const Target& target) {
  MapIdentity map;
  if (target.daemon) {
    const auto status = target.daemon->status();
    if (!status.ok()) return status.status();
    // Old backups are removed by this program, so it must see what the daemon sees.
    const auto here = client::resolve_server(status->data_folder);
    if (!here.ok() || here->boot_id != status->boot_id)
      return Status(Reason::UNSUPPORTED,
                    "--keep removes old backups, and the daemon that has made them is on another machine, or another "
                    "user's: run this command on its machine, as its user");
    map = status->map;
  } else {
    const auto stored = target.engine->snapshot()->get(storage::keys::map_state());
    if (!stored.ok()) return stored.status();
    if (stored->has_value()) {
      const auto state = storage::decode_state(**stored);
      if (!state.ok()) return Status(Reason::DATA_LOSS, "the map's state: " + state.status().message());
      map = state->identity;
    }
  }
  if (!map.known())
    return Status(Reason::UNSUPPORTED,
                  "the map has no identity yet, by which its backups are told from those of other maps: the first "
                  "relmapd that serves it gives it one");
  return map.uuid;
}

// Backs the map up into a new folder in `folder`, then removes the oldest backups of the map. A backup that was made is
// in the answer, whatever follows.
Answer back_up_and_thin(const Context& context, const Target& target, const std::string& folder, std::size_t keep,
                        std::vector<std::string>& removed, std::optional<client::Backup>& made) {
  const auto map = map_of(target);
  if (!map.ok()) return {map.status(), false, {}};
  const auto kept = KeptBackups::open(folder, *map);
  if (!kept.ok()) return {kept.status(), false, {}};
  auto backup = back_up(context, target, kept->next(now_us() / 1'000'000));
  if (!backup.ok()) return {backup.status(), false, {}};
  made = std::move(*backup);
  const Status thinned = kept->thin(keep, made->folder, [&](const std::string& path) { removed.push_back(path); });
  if (thinned.ok()) return {};
  return {Status(thinned.reason(), "the backup is made, but " + thinned.message()),
          thinned.reason() == Reason::DATA_LOSS,
          {}};
}

Answer back_up_map(const BackupAsked& asked, Context& context) {
  const bool by_server = !context.server.empty();  // then the first name is the only one
  if (by_server == !asked.second.empty())
    throw CLI::ValidationError("backup needs DIR and BACKUP, or --server HOST:PORT and BACKUP");
  const std::string directory = by_server ? "" : asked.first;
  const std::string folder =
      by_server ? asked.first : std::filesystem::weakly_canonical(std::filesystem::absolute(asked.second)).string();
  const auto target = open_target(context, directory, Access::kWrite);
  if (!target.ok()) return {target.status(), false, {}};
  Answer answer;
  std::optional<client::Backup> made;
  std::vector<std::string> removed;
  if (asked.keep > 0) {
    answer = back_up_and_thin(context, *target, folder, asked.keep, removed, made);
  } else {
    auto backup = back_up(context, *target, folder);
    if (backup.ok()) made = std::move(*backup);
    answer.status = backup.status();
  }
  if (!made) return answer;
  context.say(made->folder + ": " + terminal::bytes_text(made->bytes) + ", everything up to journal record " +
              std::to_string(made->durable_sequence));
  for (const std::string& path : removed) context.say(path + ": removed");
  answer.json.add("folder", made->folder)
      .add("bytes", made->bytes)
      .add("durable_sequence", made->durable_sequence)
      .add("removed", removed);
  return answer;
}

}  // namespace

void add_backup(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("backup", "copy a map into a new data folder; the daemon may keep running");
  auto asked = std::make_shared<BackupAsked>();
  command->add_option("DIR", asked->first, "data folder of the map; leave it out with --server")
      ->type_name("FOLDER")
      ->required();
  command
      ->add_option("BACKUP", asked->second, "folder to create; with --server an absolute path on the daemon's machine")
      ->type_name("FOLDER");
  command
      ->add_option("--keep", asked->keep,
                   "BACKUP is a folder of backups: make a new one in it, then remove the oldest of this map beyond so "
                   "many")
      ->check(CLI::Range(std::size_t{1}, std::size_t{100000}));
  command->footer(R"(
The backup has everything that was acknowledged before the command began. It is a data folder that relmapd can open, to
look at it; to go on in the map's place, restore it, so that robots learn of it and no session number is given out twice.
It gets its name only when it is complete. On the file system of the map it shares files with the map, so that one bad
sector damages both: put it on another disk, or copy it there.

With --keep the new backup is called by time and map, as in 2026-11-30T12-00-00Z-1b4e28ba. Only once it is complete are
old ones removed, and nothing but backups that this command has made of this map: a backup that is renamed stays for
good. If one cannot be removed, the command fails, with the new backup made. There must be room for one more than are
kept, BACKUP must belong to this user alone, and a daemon must be one of this machine and user.

Examples:
  relmap-admin backup /var/lib/relmap/map /backup/map-monday
  relmap-admin backup /var/lib/relmap/map /backup --keep 7
  relmap-admin --server map.example:50070 --credentials anna.pem backup /backup/map-monday)");
  command->callback([&action, asked] { action = [asked](Context& context) { return back_up_map(*asked, context); }; });
}

}  // namespace relmap::admin
