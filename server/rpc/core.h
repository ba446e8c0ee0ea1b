// What the RPC services share, and how each handler is given the parts that it uses.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <vector>

#include "proto/base/mutex.h"
#include "server/intake/ingest_server.h"
#include "server/map/mapper.h"
#include "server/route/overlay/route_index.h"
#include "server/route/overlay/route_search.h"
#include "server/rpc/charge.h"
#include "server/rpc/connections.h"
#include "server/rpc/deadline.h"
#include "server/rpc/edit_log.h"
#include "server/rpc/gatekeeper.h"
#include "server/rpc/limits.h"
#include "server/rpc/maintenance_turn.h"
#include "server/rpc/metrics.h"
#include "server/rpc/tls_files.h"
#include "server/rpc/token_keeper.h"
#include "server/rpc/watch_feed.h"

namespace relmap::rpc {

// Facts that do not change while the daemon runs.
struct DaemonFacts {
  std::string version;
  std::string boot_id;
  std::string data_folder;
  std::string lcm_url;  // empty if LCM is off
  bool deterministic = false;
  std::uint64_t pid = 0;
  std::int64_t started_us = 0;                 // UTC
  std::string commit = {};                     // of the source; empty: not known
  std::vector<std::string> backup_roots = {};  // folders below which backups may be made; empty: nowhere
};

// Counts of the intake since the daemon started.
struct IngestFacts {
  Status lcm;  // why LCM ingest does not run; ok if it does
  std::uint64_t parts = 0, parts_corrupt = 0;
  std::uint64_t keyframes = 0, repeats = 0;
  std::uint64_t acknowledgements = 0;
  std::uint64_t robots = 0;      // sessions heard from in the last minute
  std::uint64_t incomplete = 0;  // keyframes of which parts are missing now
  std::map<Reason, std::uint64_t> not_taken;
};

struct ProcessFacts {
  std::size_t resident_bytes = 0, peak_resident_bytes = 0;
  double cpu_s = 0;                           // of user and system, since the start
  std::size_t open_files = 0, max_files = 0;  // descriptors
};
using ProcessProbe = std::function<ProcessFacts()>;

// A part of the daemon that can be in trouble by itself.
struct ComponentHealth {
  std::string name;  // storage, worker, intake
  Status state;
};

struct HealthFacts {
  std::vector<ComponentHealth> components;
  // Whether journal, worker and intake make progress. If not, only a new start helps.
  bool live = true;
  // Steps of the system's clock since the start, and the last of them: by how many seconds, and how long ago.
  std::uint64_t clock_steps = 0;
  double clock_step_s = 0, clock_step_age_s = 0;

  // Whether keyframes are taken in and questions answered.
  bool ready() const {
    return live && std::all_of(components.begin(), components.end(),
                               [](const ComponentHealth& component) { return component.state.ok(); });
  }
};
using HealthProbe = std::function<HealthFacts()>;

class Gateway;

// What lets callers in; null while no server runs.
struct Transport {
  const Connections* connections = nullptr;
  const Gatekeeper* gatekeeper = nullptr;
  const TlsWatch* tls = nullptr;
  const Gateway* gateway = nullptr;
};

// The intake of keyframes.
struct Intake {
  intake::IngestServer* server = nullptr;  // null if this daemon takes in no keyframes
  std::function<IngestFacts()> facts;      // empty if nothing is counted
};

struct SeenEnds;  // route_request.h

// A route that is being streamed, with its alternatives; it is kept as long as its stream may be resumed.
struct FoundRoute {
  FoundRoute(storage::Budget& budget, std::uint64_t n) : number(n), charge(budget, storage::Share::kReplies) {}

  const std::uint64_t number;  // counts the routes of this run of the daemon
  std::shared_ptr<const storage::MapView> view;
  route::RouteAnswer answer;
  std::vector<route::Alternative> alternatives;
  std::shared_ptr<const SeenEnds> from, to;  // the ends that are views
  std::uint32_t fingerprint = 0;             // of the request without its ends
  std::uint32_t ends_fingerprint = 0;
  Charge charge;

  std::size_t routes() const { return 1 + alternatives.size(); }
  const route::Route& route(std::size_t n) const { return n == 0 ? answer.route : alternatives[n - 1].route; }
  std::size_t memory_bytes() const {
    std::size_t bytes = 0;
    for (std::size_t n = 0; n < routes(); ++n) bytes += route(n).path.memory_bytes();
    return bytes;
  }
};
inline bool is_cut_off(const FoundRoute& found) { return found.view->expired(); }

// The index that FindRoute searches, and the routes that it found.
struct Routes {
  explicit Routes(std::string_view boot_id) : found(boot_id, "route", 64) {}

  std::unique_ptr<route::RouteIndex> index;  // null if routes are searched frame by frame
  TokenKeeper<FoundRoute> found;             // routes whose streams may be resumed
  std::atomic<std::uint64_t> searched = 0;
};

// Locked during an import, and guards no data: a piece of a graph is checked against what the map holds, so imports
// take turns.
struct ImportTurn {
  Mutex mutex;
};

// Locked while the pictures' reserve of memory is in use, and guards no data.
struct PictureTurn {
  Mutex mutex;
};

class AuditLog;

// Where edits and calls of operators are written down; null: nowhere, or no server runs.
struct Audit {
  AuditLog* log = nullptr;
};

// Owns what the handlers work on. A handler does not see it: it declares the parts that it uses as its last parameters,
// and call() passes them.
struct Core {
  Core(map::Mapper& m, DaemonFacts f, RpcLimits l = {})
      : mapper(m),
        facts(std::move(f)),
        limits(l),
        routes(facts.boot_id),
        views(facts.boot_id),
        edits(m.remembered_edits()),
        feed(WatchFeed::sources_of(mapper, intake)) {}

  auto parts() {
    return std::tie(mapper, facts, limits, intake, process, transport, health, routes, metrics, views, edits, imports,
                    pictures, maintenance, feed, audit);
  }

  map::Mapper& mapper;
  DaemonFacts facts;
  RpcLimits limits;
  Intake intake;
  ProcessProbe process;  // empty if not known
  Transport transport;
  HealthProbe health;  // empty if not known
  Routes routes;
  Metrics metrics;
  ViewKeeper views;
  EditLog edits;
  ImportTurn imports;
  PictureTurn pictures;
  MaintenanceTurn maintenance;
  Audit audit;
  WatchFeed feed;
};

// Calls `handler` with the parts of `core` whose types it names.
template <typename Reply, typename Request, typename... Parts>
Result<Reply> call(Core& core, Result<Reply> (*handler)(const Request&, const Deadline&, Parts...),
                   const std::type_identity_t<Request>& request, const Deadline& deadline) {
  return handler(request, deadline, std::get<std::remove_cvref_t<Parts>&>(core.parts())...);
}

}  // namespace relmap::rpc
