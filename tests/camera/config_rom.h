// The configuration ROM of an IIDC camera (IEEE 1212): its identity, and the address of its command registers.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace relmap::testing {

struct ConfigRom {
  std::uint64_t guid = 0;
  std::string vendor, model;
  std::uint32_t command_registers = 0;  // offset from the initial register space, bytes

  // The quadlets from 0xfffff0000400 on, with their checksums.
  std::vector<std::uint32_t> quadlets() const;
};

}  // namespace relmap::testing
