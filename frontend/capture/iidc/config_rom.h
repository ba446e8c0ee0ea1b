// Reads the configuration ROM of a camera (IEEE 1212, with IIDC's entries), which identifies it.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "frontend/capture/iidc/camera_link.h"
#include "proto/base/status.h"

namespace relmap::iidc {

struct ConfigRom {
  std::uint64_t guid = 0;
  std::string vendor, model;            // empty if it has no such text
  std::uint32_t vendor_id = 0;          // OUI, 24 bits
  std::uint32_t version = 0;            // unit_sw_version: 0x100 IIDC 1.04, 0x101 1.20, 0x102 1.30 and later
  std::uint64_t command_registers = 0;  // base address
};

// Parses the quadlets from kConfigRom on, at most 1,024 bytes. CORRUPT if they are no ROM of a 1394 node or have
// invalid pointers; TRUNCATED if they point beyond the end; UNSUPPORTED if it is no IIDC camera. Checksums are ignored,
// since many cameras have wrong ones.
Result<ConfigRom> parse_config_rom(std::span<const std::uint32_t> quadlets);

// Reads the ROM to its end, one quadlet at a time, since some cameras refuse longer reads. The errors of read().
Result<std::vector<std::uint32_t>> read_config_rom(CameraLink& link);

}  // namespace relmap::iidc
