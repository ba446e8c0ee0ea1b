// Elapsed time.
#pragma once

#include <chrono>

namespace relmap::bench {

using Clock = std::chrono::steady_clock;

inline double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}
inline double microseconds_since(Clock::time_point begin) { return 1e6 * seconds_since(begin); }

}  // namespace relmap::bench
