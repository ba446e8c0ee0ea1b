#include <memory>

#include "tools/relmap/commands.h"
#include "tools/relmap/robot_trouble.h"
#include "tools/relmap/status_view.h"

namespace relmap::cli {

namespace {

Status show_status(bool all, client::Client& client, terminal::Console& console) {
  StatusMoment now;
  auto status = client.status();
  if (!status.ok()) return status.status();
  if (console.json) return {};
  now.status = *std::move(status);
  if (auto robots = client.robots(); robots.ok()) now.robots = *std::move(robots);
  if (const auto sessions = client.sessions(); sessions.ok()) now.frozen = frozen_ones(*sessions);
  print_status(now, all, console);
  return {};
}

}  // namespace

void add_status(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("status", "show the state of daemon and map, with what needs attention first");
  auto all = std::make_shared<bool>(false);
  command->add_flag(
      "--all", *all,
      "show also each share of memory, the journal's sequences, and the source and licence of the vocabulary");
  command->footer(
      "Examples:\n"
      "  relmap status\n"
      "  relmap status --all\n"
      "  relmap --json status | jq -r .storageReason");
  command->callback([&action, all] {
    action = [all](client::Client& client, terminal::Console& console) { return show_status(*all, client, console); };
  });
}

void add_wait(CLI::App& app, Action& action) {
  auto* command = app.add_subcommand("wait", "wait until everything received is applied, looked up and relaxed");
  command->footer(
      "Exit codes:\n"
      "  0  nothing is left to do\n"
      "  1  something still is after --deadline seconds (DEADLINE)\n"
      "\n"
      "Examples:\n"
      "  relmap wait\n"
      "  relmap --deadline 600 wait");
  command->callback(
      [&action] { action = [](client::Client& client, terminal::Console&) { return client.wait_idle(); }; });
}

}  // namespace relmap::cli
