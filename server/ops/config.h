// The settings of relmapd, from a YAML file and the command line. The command line takes precedence.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "proto/base/status.h"
#include "server/ingest/lcm_ingest.h"
#include "server/map/mapper.h"
#include "server/map/way_around.h"
#include "server/route/weight.h"
#include "server/rpc/limits.h"
#include "server/rpc/listener.h"
#include "server/rpc/server.h"

namespace relmap::ops {

struct Config {
  std::string data;          // folder of the map
  std::string socket;        // path of the Unix socket; empty: DIR/socket
  std::string socket_group;  // whose members may use DIR/socket, besides the user that runs the daemon; empty: nobody
  std::string listen;        // HOST:PORT of gRPC over TCP; port 0: any free port; empty: only the socket
  bool insecure = false;     // no TLS: everyone who can reach `listen` or `http` is an operator
  std::string http;          // HOST:PORT or PORT of metrics and health over HTTP; empty: none
  std::string credentials;   // folder of `relmap-admin credentials`, whose files the next two take if they name none
  rpc::TlsFiles tls;
  std::string audit;   // file of the audit log; empty: audit.jsonl in `data`; "none": there is none
  std::string access;  // file of tokens and revocations (proto/access/access_list.h)
  rpc::ConnectionLimits connections;
  std::string lcm;  // LCM URL; empty: off
  ingest::LcmAuthentication::Who lcm_authentication = ingest::LcmAuthentication::Who::kAll;
  std::vector<std::string> lcm_proving;  // with kSome: the robots whose messages must be sealed
  std::string lcm_key;                   // file of the fleet's secret (proto/access/datagram_seal.h)
  double max_keyframes_per_s = 100;      // mean that one robot may send over LCM; 0: no limit
  double max_new_sessions_per_min = 60;  // that one robot may begin (IntakeOptions); 0: no limit
  std::vector<std::string> robots;       // names of the robots whose keyframes are taken; empty: all
  std::uint64_t memory_budget_mb = 1024;
  std::uint64_t disk_low_water_mb = 256;  // with less free disk space nothing is taken in
  std::vector<std::string> backup_roots;  // absolute paths of folders below which backups may be made; empty: nowhere
  std::string vocabulary;                 // file; empty: the shipped one
  std::uint64_t events_max_mb = 64;       // of the log of events, on disk
  std::string log_level = "info";
  std::string log_format = "auto";  // monitor::log_formats()
  double hung_after_s = 10;         // at one piece of work; then the daemon counts as dead (monitor::judge())
  rpc::RpcLimits rpc;
  map::MapperOptions map;
  // Metrics, beside distance and time, for which operators get routes in milliseconds. Each takes memory.
  std::vector<route::RouteWeights> route_mixes{route::kByTimeStandingToo, route::kByCertainty};

  std::vector<route::RouteWeights> route_metrics() const {
    std::vector<route::RouteWeights> metrics{route::kByDistance, route::kByTime};
    if (map.closures && !map.deterministic) metrics.push_back(map::kWithoutStops);  // lookups ask for it
    metrics.insert(metrics.end(), route_mixes.begin(), route_mixes.end());
    return metrics;
  }
};

// Sets the keys of the file in `config`; other settings do not change. BAD_CONFIG with "FILE:LINE: ..." for a key that
// is unknown, given twice, or has a value of the wrong kind or out of range; `config` then stays as it was.
// NO_SUCH_FILE.
Status read_config(const std::string& path, Config& config);
// The same for the text of a file. Messages use `name` for the file.
Status parse_config(std::string_view text, const std::string& name, Config& config);

// Config::lcm or Config::listen for a setting as given: "none" means off, so that the command line can override the
// file.
std::string unless_none(const std::string& said);

// Names the files in Config::credentials where the configuration names none.
void complete_config(Config& config);

// BAD_CONFIG if settings contradict each other or a necessary one is missing.
Status check_config(const Config& config);

// Where HTTP is served: HOST:PORT, or a PORT of this machine alone. BAD_CONFIG.
struct HostPort;
Result<HostPort> parse_http(std::string_view text);

struct HostPort {
  std::string host;
  std::uint16_t port = 0;
  std::string to_string() const;
};
// Parses HOST:PORT, as in "127.0.0.1:50070", "[::1]:0" or "localhost:50070". BAD_CONFIG if it is none.
Result<HostPort> parse_host_port(std::string_view text);

}  // namespace relmap::ops
