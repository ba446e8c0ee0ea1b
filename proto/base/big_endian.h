// Numbers whose most significant byte comes first, as in PNG, JPEG, LCM's log files and a camera's registers.
#pragma once

#include <cstdint>

#include "proto/base/bytes.h"

namespace relmap {

// The number that `bytes` (1 to 4) spell.
inline std::uint32_t big_endian(ByteSpan bytes) {
  std::uint32_t value = 0;
  for (const std::uint8_t byte : bytes) value = value << 8 | byte;
  return value;
}

}  // namespace relmap
