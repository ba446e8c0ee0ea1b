// What the handlers stand on.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "server/intake/ingest_server.h"
#include "server/map/mapper.h"
#include "server/route/overlay/route_index.h"
#include "server/rpc/edit_log.h"
#include "server/rpc/found_route.h"
#include "server/rpc/limits.h"
#include "server/rpc/maintenance_turn.h"
#include "server/rpc/metrics.h"
#include "server/rpc/token_keeper.h"

namespace relmap::rpc {

// What does not change while the daemon runs.
struct DaemonFacts {
  std::string version;
  std::string boot_id;
  std::string data_folder;
  std::string lcm_url;  // empty: off
  bool deterministic = false;
  std::uint64_t pid = 0;
  std::int64_t started_us = 0;  // UTC
};

// What the way in counts, since the daemon started.
struct IngestFacts {
  Status lcm;  // not ok: LCM ingest does not run, and why
  std::uint64_t parts = 0, parts_corrupt = 0;
  std::uint64_t keyframes = 0, repeats = 0;
  std::uint64_t acknowledgements = 0;
  std::uint64_t robots = 0;      // sessions heard of in the last minute
  std::uint64_t incomplete = 0;  // now
  std::map<Reason, std::uint64_t> not_taken;
};

struct ProcessFacts {
  std::size_t resident_bytes = 0, peak_resident_bytes = 0;
};

struct Core {
  Core(map::Mapper& m, DaemonFacts f, RpcLimits l = {})
      : mapper(m), facts(std::move(f)), limits(l), views(facts.boot_id), found_routes(facts.boot_id, "route", 64) {}

  map::Mapper& mapper;
  const DaemonFacts facts;
  const RpcLimits limits;
  std::function<IngestFacts()> ingest;        // empty: there is none
  intake::IngestServer* intake = nullptr;     // null: nothing is taken in
  std::function<ProcessFacts()> process;      // empty: not known
  std::unique_ptr<route::RouteIndex> routes;  // null: routes are searched frame by frame
  Metrics metrics;
  ViewKeeper views;
  TokenKeeper<FoundRoute> found_routes;
  std::atomic<std::uint64_t> routes_searched = 0;
  EditLog edits;
  std::mutex imports;  // a piece of a graph at a time
  MaintenanceTurn maintenance;
};

}  // namespace relmap::rpc
