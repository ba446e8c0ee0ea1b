// The commands. Each add_...() declares its command on `app`; when the user chooses it, it sets `action`.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>

#include "client/admin_types.h"
#include "proto/base/json.h"
#include "proto/base/status.h"
#include "tools/terminal/console.h"
#include "tools/terminal/progress_bar.h"

namespace relmap::admin {

// What every command has at hand.
struct Context {
  terminal::Console& console;
  terminal::ProgressBar& bar;
  std::string server;       // --server; empty if it is not given
  std::string credentials;  // --credentials; empty if it is not given
  double deadline_s = 0;    // time limit of work that a daemon does
  bool quiet = false;

  // Shows progress on the bar, unless --quiet is given.
  void show(const std::string& step, std::uint64_t done, std::uint64_t total, const std::string& unit) const;
  // Prints a line in place of the bar; nothing with --json.
  void say(const std::string& line) const;
};

struct Answer {
  Status status;
  bool damage = false;
  Json json;  // the answer's keys other than reason and message
};
using Action = std::function<Answer(Context&)>;

void add_verify(CLI::App& app, Action& action);
void add_repair(CLI::App& app, Action& action);
void add_backup(CLI::App& app, Action& action);
void add_restore(CLI::App& app, Action& action);
void add_compact(CLI::App& app, Action& action);
void add_migrate(CLI::App& app, Action& action);
void add_reindex(CLI::App& app, Action& action);
void add_stats(CLI::App& app, Action& action);
void add_log_level(CLI::App& app, Action& action);
void add_credentials(CLI::App& app, Action& action);
void add_explain(CLI::App& app, Action& action);

}  // namespace relmap::admin
