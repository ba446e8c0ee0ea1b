// Where a daemon answers.
#pragma once

#include <cstdint>
#include <string>

#include "proto/base/status.h"

namespace relmap::client {

struct ServerAddress {
  std::string address;   // host:port
  std::int64_t pid = 0;  // of the daemon that wrote DIR/endpoint; 0: the address was given
  std::string boot_id;   // empty: the address was given
};

// `server`: a data folder, whose file `endpoint` says "address HOST:PORT", "pid N" and "boot ID", a line each; or
// HOST:PORT. INVALID_ARGUMENT: neither. UNREACHABLE: no daemon serves the folder. CORRUPT: its endpoint is none.
Result<ServerAddress> resolve_server(const std::string& server);

}  // namespace relmap::client
