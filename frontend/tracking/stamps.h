// Turns the time stamps of cameras and recordings into strictly increasing times.
#pragma once

#include <cstdint>
#include <optional>

#include "proto/base/status.h"

namespace relmap::tracking {

inline double seconds(std::int64_t us) { return 1e-6 * static_cast<double>(us); }

// A single stamp that goes back, or more than a minute ahead, is refused as faulty. If the stamps that follow agree
// with it, the clock was set: a jump ahead is then accepted, and after a jump back an offset is added, so that times
// continue from where they were.
class StampFilter {
 public:
  StampFilter() = default;
  explicit StampFilter(std::int64_t last_us) : last_us_(last_us) {}

  // Returns the time of a pair, later than those before. It is UTC as far as the clock is right. TIME_BACKWARDS or
  // TIME_AHEAD if the pair must be left out; the message has its stamp and the last good one, both by the current
  // clock.
  Result<std::int64_t> admit(std::int64_t stamp_us);

 private:
  Result<std::int64_t> doubt(std::int64_t stamp_us, Reason reason);

  std::optional<std::int64_t> last_us_;  // returned last
  std::int64_t interval_us_ = 100'000;   // between the last two
  std::int64_t offset_us_ = 0;           // added to stamps
  std::optional<std::int64_t> doubted_us_, first_doubted_us_;
  int doubted_ = 0;  // consecutive stamps that agree with each other and not with last_us_
};

}  // namespace relmap::tracking
