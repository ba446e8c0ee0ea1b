#include "frontend/tracking/stamps.h"

#include <algorithm>
#include <string>

namespace relmap::tracking {

namespace {
constexpr std::int64_t kMaxAheadUs = 60'000'000;
constexpr int kConfirmAhead = 2, kConfirmBack = 5;  // stamps in a row
}  // namespace

Result<std::int64_t> StampFilter::admit(std::int64_t stamp_us) {
  std::int64_t time_us = stamp_us + offset_us_;
  if (last_us_) {
    if (time_us > *last_us_ + kMaxAheadUs) {
      if (Result<std::int64_t> doubted = doubt(stamp_us, Reason::TIME_AHEAD); doubted_ < kConfirmAhead) return doubted;
    } else if (time_us <= *last_us_) {
      if (Result<std::int64_t> doubted = doubt(stamp_us, Reason::TIME_BACKWARDS); doubted_ < kConfirmBack)
        return doubted;
      // The time that passed during the refused stamps is kept.
      time_us = *last_us_ + interval_us_ + (stamp_us - *first_doubted_us_);
      offset_us_ = time_us - stamp_us;
    } else {
      interval_us_ = std::min<std::int64_t>(time_us - *last_us_, 1'000'000);
    }
  }
  doubted_us_.reset();
  doubted_ = 0;
  last_us_ = time_us;
  return time_us;
}

Result<std::int64_t> StampFilter::doubt(std::int64_t stamp_us, Reason reason) {
  const bool agrees = doubted_us_ && stamp_us > *doubted_us_ && stamp_us <= *doubted_us_ + kMaxAheadUs;
  doubted_ = agrees ? doubted_ + 1 : 1;
  if (!agrees) first_doubted_us_ = stamp_us;
  doubted_us_ = stamp_us;
  return {reason, "stamped " + std::to_string(stamp_us) + " us, " +
                      (reason == Reason::TIME_AHEAD ? "more than a minute after" : "not after") +
                      " the last good one, " + std::to_string(*last_us_ - offset_us_) + " us"};
}

}  // namespace relmap::tracking
