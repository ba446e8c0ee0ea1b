#include "tools/relmap-admin/target.h"

#include <filesystem>
#include <ostream>

#include "client/server_address.h"
#include "storage/rocksdb/folder.h"
#include "storage/rocksdb/rocksdb_engine.h"
#include "tools/terminal/interrupt.h"

namespace relmap::admin {

namespace {

// Who owns the folder, as far as it is known: "relmapd (process 4711) at 127.0.0.1:50070".
std::string owner_of(const std::string& directory) {
  const auto where = client::resolve_server(directory);
  if (!where.ok()) return storage::lock_owner(directory) + ", which serves no clients";
  return "relmapd (process " + std::to_string(where->pid) + ") at " + where->address;
}

}  // namespace

Status check_map(const std::string& directory) {
  std::error_code error;
  const bool folder = std::filesystem::is_directory(directory, error);
  const bool map = !error && folder && std::filesystem::exists(directory + "/FORMAT", error);
  if (error == std::errc::permission_denied)
    return Status(Reason::NOT_ALLOWED, "you may not read " + directory + ": run this as the user of the daemon");
  if (!folder) return Status(Reason::NO_SUCH_FILE, "there is no folder " + directory);
  if (!map) return Status(Reason::NO_SUCH_FILE, directory + " holds no map");
  return {};
}

Result<std::unique_ptr<client::Client>> connect_daemon(const Context& context, const std::string& server) {
  client::ClientOptions options = client::ClientOptions::from_environment();
  options.deadline = std::chrono::milliseconds(static_cast<std::int64_t>(context.deadline_s * 1e3));
  options.credentials = context.credentials;
  return client::Client::connect(server, options);
}

Result<Target> open_target(const Context& context, const std::string& directory, Access access) {
  if (directory.empty() && context.server.empty())
    throw CLI::ValidationError("no map is named: give DIR, or --server HOST:PORT");
  if (!directory.empty() && !context.server.empty()) throw CLI::ValidationError("give DIR or --server, not both");
  Target target;
  if (!context.server.empty()) {
    auto daemon = connect_daemon(context, context.server);
    if (!daemon.ok()) return daemon.status();
    target.daemon = std::move(*daemon);
    return target;
  }
  if (Status there = check_map(directory); !there.ok()) return there;
  storage::RocksDbOptions options;
  options.read_only = access == Access::kRead;
  auto engine = storage::open_rocksdb(directory, options);
  if (engine.ok()) {
    target.engine = std::move(*engine);
    return target;
  }
  // A folder that is another user's may have a daemon that this user may ask.
  const bool others = engine.reason() == Reason::IO_ERROR && client::resolve_server(directory).ok();
  if (engine.reason() != Reason::FOLDER_LOCKED && !others) return engine.status();
  auto daemon = connect_daemon(context, directory);
  if (!daemon.ok())
    return Status(Reason::FOLDER_LOCKED,
                  directory + " is owned by " + owner_of(directory) + ": " + daemon.status().to_string());
  if (!context.quiet)
    context.console.err() << directory << " is owned by " << owner_of(directory) << ", which does the work\n";
  target.daemon = std::move(*daemon);
  return target;
}

Status check_free(const std::string& directory) {
  if (Status there = check_map(directory); !there.ok()) return there;
  const auto lock = storage::FolderLock::take(directory);
  if (lock.reason() == Reason::FOLDER_LOCKED)
    return Status(Reason::FOLDER_LOCKED,
                  directory + " is owned by " + owner_of(directory) + "; stop it first, then run this again");
  return lock.status();
}

Status check_interrupt() { return terminal::interrupted() ? Status(Reason::DEADLINE, "interrupted") : Status(); }

void add_map(Json& json, const MapIdentity& map) {
  if (map.known()) json.add("map_uuid", map.uuid.to_string()).add("map_epoch", map.epoch);
}

storage::EngineProgress engine_progress(const Context& context, const std::string& step) {
  return [&context, step](std::uint64_t done, std::uint64_t total) {
    context.show(step, done, total, "bytes");
    return check_interrupt();
  };
}

client::OnProgress daemon_progress(const Context& context) {
  return [&context](const client::Progress& progress) {
    context.show(progress.step, progress.done, progress.total, progress.unit);
    return check_interrupt().ok();
  };
}

}  // namespace relmap::admin
