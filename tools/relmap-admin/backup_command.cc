#include <filesystem>
#include <memory>

#include "tools/relmap-admin/target.h"

namespace relmap::admin {

namespace {

struct BackupAsked {
  std::string first, second;
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

Answer back_up_map(const BackupAsked& asked, Context& context) {
  const bool by_server = !context.server.empty();  // then the first name is the only one
  if (by_server == !asked.second.empty())
    throw CLI::ValidationError("backup needs DIR and BACKUP, or --server HOST:PORT and BACKUP");
  const std::string directory = by_server ? "" : asked.first;
  const std::string folder =
      by_server ? asked.first : std::filesystem::weakly_canonical(std::filesystem::absolute(asked.second)).string();
  const auto target = open_target(context, directory, Access::kWrite);
  if (!target.ok()) return {target.status(), false, {}};
  const auto backup = target->daemon ? target->daemon->backup(folder, daemon_progress(context))
                                     : back_up(context, *target->engine, folder);
  if (!backup.ok()) return {backup.status(), false, {}};
  context.say(backup->folder + ": " + terminal::bytes_text(backup->bytes) + ", everything up to journal record " +
              std::to_string(backup->durable_sequence));
  Answer answer;
  answer.json.add("folder", backup->folder)
      .add("bytes", backup->bytes)
      .add("durable_sequence", backup->durable_sequence);
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
  command->footer(R"(
The backup has everything that was acknowledged before the command began. It is a data folder that relmapd can open, to
look at it; to go on in the map's place, restore it, so that robots learn of it and no session number is given out twice.
It gets its name only when it is complete. On the file system of the map it shares files with the map, so that one bad
sector damages both: put it on another disk, or copy it there.

Examples:
  relmap-admin backup /var/lib/relmap /backup/map-monday
  relmap-admin --server map.example:50070 --credentials anna.pem backup /backup/map-monday)");
  command->callback([&action, asked] { action = [asked](Context& context) { return back_up_map(*asked, context); }; });
}

}  // namespace relmap::admin
