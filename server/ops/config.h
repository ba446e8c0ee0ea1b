// What relmapd can be told, by a YAML file and by its command line (which wins).
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "proto/base/status.h"
#include "server/map/mapper.h"
#include "server/route/weight.h"
#include "server/rpc/limits.h"

namespace relmap::ops {

struct Config {
  std::string data;                        // folder of the map
  std::string listen = "127.0.0.1:50070";  // HOST:PORT of gRPC; port 0: any free one
  bool insecure = false;                   // allows to listen beyond loopback, where everyone is operator
  std::string lcm;                         // LCM URL; empty: off
  double max_keyframes_per_s = 100;        // that one robot may bring over LCM in the long run; 0: any number
  std::vector<std::string> robots;         // whose keyframes are taken, by name; empty: all
  std::uint64_t memory_budget_mb = 1024;
  std::uint64_t disk_low_water_mb = 256;  // free below it: nothing is taken in
  std::string vocabulary;                 // file; empty: the one shipped
  std::string log_level = "info";
  rpc::RpcLimits rpc;
  map::MapperOptions map;
  // What routes are found by in milliseconds, beside distance and time. Each takes memory.
  std::vector<route::RouteWeights> route_mixes{route::kByTimeStandingToo, route::kByCertainty};

  std::vector<route::RouteWeights> route_metrics() const {
    std::vector<route::RouteWeights> metrics{route::kByDistance, route::kByTime};
    metrics.insert(metrics.end(), route_mixes.begin(), route_mixes.end());
    return metrics;
  }
};

// Changes `config` as the file says; what it leaves out stays. BAD_CONFIG with "FILE:LINE: ..." for a key that is
// unknown, given twice, or has a value of the wrong kind or out of range; NO_SUCH_FILE.
Status read_config(const std::string& path, Config& config);
// The same from text; `name` stands for the file in messages.
Status parse_config(std::string_view text, const std::string& name, Config& config);

// Config::lcm as people say it: "none" is off too, so that a command line can take back what the file says.
std::string lcm_url_of(const std::string& said);

// BAD_CONFIG if parts contradict each other or something needed is missing.
Status check_config(const Config& config);

struct HostPort {
  std::string host;
  std::uint16_t port = 0;
  bool loopback = false;  // 127.0.0.0/8, ::1 or localhost
  std::string to_string() const;
};
// "127.0.0.1:50070", "[::1]:0", "localhost:50070". BAD_CONFIG.
Result<HostPort> parse_host_port(std::string_view text);

}  // namespace relmap::ops
