// DIR/endpoint: where the daemon that owns the data folder DIR answers. It is there only while the daemon serves
// (after a crash it stays behind; its pid and boot id tell).
//
//   address 127.0.0.1:50070
//   pid 4711
//   boot 3f0c...
#pragma once

#include <cstdint>
#include <string>

#include "proto/base/status.h"

namespace relmap::ops {

struct Endpoint {
  std::string address;  // host:port
  std::int64_t pid = 0;
  std::string boot_id;
};

// Written beside, then renamed into place. IO_ERROR.
Status write_endpoint(const std::string& data_folder, const Endpoint& endpoint);
void remove_endpoint(const std::string& data_folder);

}  // namespace relmap::ops
