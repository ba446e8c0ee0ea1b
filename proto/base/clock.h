// The time of day in the form that all of relmap uses.
#pragma once

#include <chrono>
#include <cstdint>

namespace relmap {

// Microseconds since 1970, UTC.
inline std::int64_t now_us() {
  return std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::system_clock::now().time_since_epoch())
      .count();
}

}  // namespace relmap
