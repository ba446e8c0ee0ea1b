// Finds the address of a daemon.
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

// `server` is HOST:PORT, or a data folder, whose file `endpoint` has the lines "address HOST:PORT", "pid N" and
// "boot ID". INVALID_ARGUMENT: it is neither. UNREACHABLE: no daemon serves the folder. CORRUPT: the file is malformed.
Result<ServerAddress> resolve_server(const std::string& server);

}  // namespace relmap::client
