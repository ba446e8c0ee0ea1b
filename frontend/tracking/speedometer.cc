#include "frontend/tracking/speedometer.h"

namespace relmap::tracking {

namespace {
constexpr std::int64_t kSpanUs = 500'000;
}

void Speedometer::add(std::int64_t time_us, const Vector3& position) {
  const std::int64_t elapsed = entries_.empty() ? 0 : time_us - entries_.back().time_us;
  // Keep the newest entry that is at least as old as the span, and those after it.
  while (entries_.size() > 1 && time_us - entries_[1].time_us >= kSpanUs) entries_.pop_front();
  entries_.push_back({time_us, position});
  if (elapsed <= 0) return;
  const Entry& from = entries_.front();
  speed_ = (position - from.position).norm() / (1e-6 * static_cast<double>(time_us - from.time_us));
  (speed_ < kStandingSpeed ? standing_us_ : driven_us_) += elapsed;
}

}  // namespace relmap::tracking
