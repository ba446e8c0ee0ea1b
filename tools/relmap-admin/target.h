// What a command works on: a data folder that this process owns meanwhile, or the daemon that owns it.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "client/relmap_client.h"
#include "storage/engine/engine.h"
#include "tools/relmap-admin/commands.h"

namespace relmap::admin {

struct Target {
  // One of the two is set.
  std::shared_ptr<storage::Engine> engine;
  std::unique_ptr<client::Client> daemon;
};

enum class Access { kRead, kWrite };

// Opens the map in `directory`, or connects to the daemon that owns it or that --server names. Throws
// CLI::ValidationError unless exactly one of `directory` and --server is given. NO_SUCH_FILE if there is no map;
// FOLDER_LOCKED if a process owns it that does not answer; UNREACHABLE.
Result<Target> open_target(const Context& context, const std::string& directory, Access access);

// Connects to the daemon that serves a data folder, or that is at HOST:PORT. As client::Client::connect().
Result<std::unique_ptr<client::Client>> connect_daemon(const Context& context, const std::string& server);

// Checks that the folder holds a map that no process owns. FOLDER_LOCKED with the daemon to stop; NO_SUCH_FILE.
Status check_free(const std::string& directory);

// Adds the identity of the map, if it is known, as the keys "map_uuid" and "map_epoch".
void add_map(Json& json, const MapIdentity& map);

// Show the progress of an engine or of a daemon on the bar, and stop the work after an interrupt.
storage::EngineProgress engine_progress(const Context& context, const std::string& step);
client::OnProgress daemon_progress(const Context& context);
// DEADLINE after an interrupt.
Status check_interrupt();

}  // namespace relmap::admin
