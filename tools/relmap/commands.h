// The commands. Each add_...() declares its command on `app`; when the user chooses it, it sets `action`.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

#include "client/relmap_client.h"
#include "tools/terminal/console.h"

namespace relmap::cli {

inline constexpr std::size_t kMaxListed = 8;  // things of a kind that a message lists

// The work of a command, called with a connected client.
using Action = std::function<Status(client::Client&, terminal::Console&)>;

void add_status(CLI::App& app, Action& action);
void add_wait(CLI::App& app, Action& action);
void add_top(CLI::App& app, Action& action);
void add_watch(CLI::App& app, Action& action);
void add_sessions(CLI::App& app, Action& action);
void add_session(CLI::App& app, Action& action);
void add_frame(CLI::App& app, Action& action);
void add_transform(CLI::App& app, Action& action);
void add_localise(CLI::App& app, Action& action);
void add_match(CLI::App& app, Action& action);
void add_route(CLI::App& app, Action& action);
void add_label(CLI::App& app, Action& action);
void add_labels(CLI::App& app, Action& action);
void add_edges(CLI::App& app, Action& action);
void add_edge(CLI::App& app, Action& action);
void add_import(CLI::App& app, Action& action);
void add_ingest(CLI::App& app, Action& action);
void add_export(CLI::App& app, Action& action);
void add_map(CLI::App& app, Action& action);
void add_report(CLI::App& app, Action& action);

}  // namespace relmap::cli
