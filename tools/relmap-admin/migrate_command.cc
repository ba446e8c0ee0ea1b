#include <memory>

#include "storage/migrate/migrate.h"
#include "tools/relmap-admin/target.h"

namespace relmap::admin {

namespace {

Answer migrate_map(const std::string& directory, Context& context) {
  if (!context.server.empty()) throw CLI::ValidationError("migrate works on a folder, not on a daemon");
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
  auto directory = std::make_shared<std::string>();
  command->add_option("DIR", *directory, "data folder; no daemon may own it")->type_name("FOLDER")->required();
  command->footer(R"(
The former map is kept beside the new one, so there must be room for both. Delete it when the new one works.

Examples:
  relmap-admin migrate /var/lib/relmap)");
  command->callback(
      [&action, directory] { action = [directory](Context& context) { return migrate_map(*directory, context); }; });
}

}  // namespace relmap::admin
