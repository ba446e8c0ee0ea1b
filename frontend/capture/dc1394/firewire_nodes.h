// What hangs on this machine's IEEE 1394 buses, as the kernel tells.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "proto/base/status.h"

namespace relmap::iidc::dc1394 {

inline constexpr const char* kFirewireNodes = "/sys/bus/firewire/devices";

struct FirewireNode {
  std::uint64_t guid = 0;
  std::string file;           // "/dev/fw1"
  std::string vendor, model;  // empty where it does not say
  bool camera = false;        // it has a unit of IIDC
};

// By their files. UNSUPPORTED: the machine has no adapter, or its kernel no driver for one.
Result<std::vector<FirewireNode>> firewire_nodes(const std::string& folder = kFirewireNodes);

}  // namespace relmap::iidc::dc1394
