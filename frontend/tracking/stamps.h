// Time stamps of pictures as cameras and recordings give them, made into times that rise.
#pragma once

#include <cstdint>
#include <optional>

#include "proto/base/status.h"

namespace relmap::tracking {

// A stamp that goes back, or far ahead, is refused: one such stamp is a fault of its own. If the pairs that follow
// agree with it, the clock was set: then a jump ahead is believed, and after a jump back the new clock is taken to go
// on where the old one stood.
class StampFilter {
 public:
  StampFilter() = default;
  explicit StampFilter(std::int64_t last_us) : last_us_(last_us) {}

  // The time of a pair, UTC as far as it is known; later than those before. TIME_BACKWARDS, TIME_AHEAD: leave it out;
  // the message has its stamp and the last good one, both by the clock as it stands.
  Result<std::int64_t> admit(std::int64_t stamp_us);

 private:
  Result<std::int64_t> doubt(std::int64_t stamp_us, Reason reason);

  std::optional<std::int64_t> last_us_;  // given out
  std::int64_t interval_us_ = 100'000;   // between the last two
  std::int64_t offset_us_ = 0;           // added to stamps
  std::optional<std::int64_t> doubted_us_, first_doubted_us_;
  int doubted_ = 0;  // stamps in a row that agree with each other and not with the time before
};

}  // namespace relmap::tracking
