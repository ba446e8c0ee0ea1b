#include <memory>

#include "tools/relmap-admin/target.h"

namespace relmap::admin {

namespace {

struct LevelAsked {
  std::string first, second;
};

Answer change_level(const LevelAsked& asked, Context& context) {
  const bool by_server = !context.server.empty();  // then the only name is the level
  if (by_server ? !asked.second.empty() : asked.first.empty())
    throw CLI::ValidationError("log-level needs DIR and perhaps LEVEL, or --server HOST:PORT and perhaps LEVEL");
  const std::string level = by_server ? asked.first : asked.second;
  const auto daemon = connect_daemon(context, by_server ? context.server : asked.first);
  if (!daemon.ok()) return {daemon.status(), false, {}};
  const auto former = (*daemon)->set_log_level(level);
  if (!former.ok()) return {former.status(), false, {}};
  const std::string now = level.empty() ? *former : level;
  context.say(level.empty() ? now : "the log level is " + now + " now, and was " + *former);
  Answer answer;
  answer.json.add("level", now).add("former", *former);
  return answer;
}

}  // namespace

void add_log_level(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("log-level", "show or change what a running daemon's log tells");
  auto asked = std::make_shared<LevelAsked>();
  command->add_option("DIR", asked->first, "data folder of the daemon, or the folder of its socket; not with --server");
  command->add_option("LEVEL", asked->second, "trace, debug, info, warning or error; without it the level is shown");
  command->footer(R"(
The level holds until it is changed again, the daemon reads its settings again (SIGHUP) or is started again.

Examples:
  relmap-admin log-level /var/lib/relmap/map debug
  relmap-admin --server map.example:50070 --credentials anna.pem log-level info)");
  command->callback([&action, asked] { action = [asked](Context& context) { return change_level(*asked, context); }; });
}

}  // namespace relmap::admin
