// What a camera says of itself: its configuration ROM (IEEE 1212), as IIDC fills it in.
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
  std::string vendor, model;            // empty where it has no such text
  std::uint32_t vendor_id = 0;          // OUI, 24 bits
  std::uint32_t version = 0;            // unit_sw_version: 0x100 IIDC 1.04, 0x101 1.20, 0x102 1.30 and later
  std::uint64_t command_registers = 0;  // address of their base
};

// Quadlets from kConfigRom on; 1,024 bytes at most. CORRUPT: no ROM of a 1394 node, or its directories point nowhere;
// TRUNCATED: they point behind what is given; UNSUPPORTED: it is no IIDC camera. Checksums are not looked at: many
// cameras have wrong ones.
Result<ConfigRom> parse_config_rom(std::span<const std::uint32_t> quadlets);

// Quadlet by quadlet, as far as there are any (a longer read is refused by some). read()'s errors.
Result<std::vector<std::uint32_t>> read_config_rom(CameraLink& link);

}  // namespace relmap::iidc
