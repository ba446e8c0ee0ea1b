// The file DIR/endpoint tells where the daemon that owns the data folder DIR serves. It exists while the daemon serves.
// After a crash it stays behind, which can be told by its pid and boot id.
//
//   socket /srv/map/socket
//   address 0.0.0.0:50070     (if it serves over TCP, too)
//   http 127.0.0.1:50071      (if it serves metrics and health over HTTP)
//   pid 4711
//   boot 3f0c...
#pragma once

#include <cstdint>
#include <string>

#include "proto/base/status.h"

namespace relmap::ops {

struct Endpoint {
  std::string socket;   // absolute path
  std::string address;  // host:port; empty: only the socket
  std::int64_t pid = 0;
  std::string boot_id;
  std::string http = {};  // host:port; empty: none
};

// Writes the file `endpoint` in the folder atomically, by renaming a temporary one. IO_ERROR.
Status write_endpoint(const std::string& folder, const Endpoint& endpoint);
void remove_endpoint(const std::string& folder);

}  // namespace relmap::ops
