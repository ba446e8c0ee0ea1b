// Finds the address of a daemon.
#pragma once

#include <cstdint>
#include <string>

#include "proto/base/status.h"

namespace relmap::client {

struct ServerAddress {
  std::string address;   // host:port, or unix:PATH
  std::int64_t pid = 0;  // of the daemon that wrote DIR/endpoint; 0: the address was given
  std::string boot_id;   // empty: the address was given

  // Whether it is a Unix socket of this machine, where no credentials are asked for.
  bool is_socket() const { return address.starts_with("unix:"); }
};

// `server` is HOST:PORT, unix:PATH, or a data folder, whose file `endpoint` has the lines "socket PATH" or "address
// HOST:PORT" (the socket is preferred), "pid N" and "boot ID". INVALID_ARGUMENT: it is none of these. UNREACHABLE: no
// daemon serves the folder. CORRUPT: the file is malformed.
Result<ServerAddress> resolve_server(const std::string& server);

}  // namespace relmap::client
