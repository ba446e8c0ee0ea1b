#include <memory>

#include "tools/relmap-admin/target.h"

namespace relmap::admin {

namespace {

Result<client::Compaction> compact(const Context& context, storage::Engine& engine) {
  const auto before = engine.stats();
  if (!before.ok()) return before.status();
  if (Status done = engine.compact(engine_progress(context, "compacting")); !done.ok()) return done;
  const auto after = engine.stats();
  if (!after.ok()) return after.status();
  return client::Compaction{before->map_bytes, after->map_bytes};
}

Answer compact_map(const std::string& directory, Context& context) {
  const auto target = open_target(context, directory, Access::kWrite);
  if (!target.ok()) return {target.status(), false, {}};
  const auto done =
      target->daemon ? target->daemon->compact(daemon_progress(context)) : compact(context, *target->engine);
  if (!done.ok()) return {done.status(), false, {}};
  context.say(terminal::bytes_text(done->bytes_before) + " before, " + terminal::bytes_text(done->bytes_after) +
              " now");
  Answer answer;
  answer.json.add("bytes_before", done->bytes_before).add("bytes_after", done->bytes_after);
  return answer;
}

}  // namespace

void add_compact(CLI::App& app, Action& action) {
  auto* command =
      app.add_subcommand("compact", "give back disk space of replaced data; needs room for a copy meanwhile");
  auto directory = std::make_shared<std::string>();
  command->add_option("DIR", *directory, "data folder")->type_name("FOLDER");
  command->footer(R"(
RocksDB gives space back by itself, but late. This command does it at once; a daemon may keep running.

Examples:
  relmap-admin compact /var/lib/relmap/map)");
  command->callback(
      [&action, directory] { action = [directory](Context& context) { return compact_map(*directory, context); }; });
}

}  // namespace relmap::admin
