// The configuration ROM of an IIDC camera (IEEE 1212): who it is, and where its command registers are.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace relmap::testing {

struct ConfigRom {
  std::uint64_t guid = 0;
  std::string vendor, model;
  std::uint32_t command_registers = 0;  // offset from the initial register space, bytes

  // Quadlets from 0xfffff0000400 on, with all their check sums.
  std::vector<std::uint32_t> quadlets() const;
};

}  // namespace relmap::testing
