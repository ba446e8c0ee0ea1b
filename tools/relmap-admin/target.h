// What a command works on: a data folder that is ours while we do, or the daemon that owns it.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "client/relmap_client.h"
#include "storage/engine/engine.h"
#include "tools/relmap-admin/commands.h"

namespace relmap::admin {

struct Target {
  std::shared_ptr<storage::Engine> engine;  // or
  std::unique_ptr<client::Client> daemon;
};

enum class Access { kRead, kWrite };

// `directory` or --server: one of them must be given, else CLI::ValidationError. NO_SUCH_FILE: there is no map.
// FOLDER_LOCKED: a process owns it that cannot be asked. UNREACHABLE.
Result<Target> open_target(const Context& context, const std::string& directory, Access access);

// The folder is nobody else's, and holds a map. FOLDER_LOCKED naming the daemon to stop, NO_SUCH_FILE.
Status check_free(const std::string& directory);

// Which map it is, as keys of an answer: "map_uuid" and "map_epoch", if it is known.
void add_map(Json& json, const MapIdentity& map);

// The engine's progress on the bar; DEADLINE once interrupted.
storage::EngineProgress engine_progress(const Context& context, const std::string& step);
client::OnProgress daemon_progress(const Context& context);
// DEADLINE once interrupted.
Status check_interrupt();

}  // namespace relmap::admin
