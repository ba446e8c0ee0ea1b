// Lists the devices on this machine's IEEE 1394 buses, from the kernel.
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
  std::string vendor, model;  // empty if not stated
  bool camera = false;        // it has an IIDC unit
};

// Sorted by file. UNSUPPORTED if the machine has no adapter, or the kernel no driver for it.
Result<std::vector<FirewireNode>> firewire_nodes(const std::string& folder = kFirewireNodes);

}  // namespace relmap::iidc::dc1394
