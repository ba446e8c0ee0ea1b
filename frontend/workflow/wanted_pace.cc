#include "frontend/workflow/wanted_pace.h"

#include <cstdio>

namespace relmap::workflow {

std::optional<std::string> WantedPace::hear(const PoseNews& news, Time now) {
  if (news.kind == PoseNews::Kind::kSlowDown) {
    said_at_ = now;
    if (wanted_hz_.exchange(news.rate_hz) != 0) return {};
    ++slow_downs_;
    char rate[32];
    std::snprintf(rate, sizeof rate, "%g", news.rate_hz);
    return "the daemon asks for at most " + std::string(rate) + " keyframes/s";
  }
  if (news.kind == PoseNews::Kind::kResume && wanted_hz_.exchange(0) != 0)
    return "the daemon takes keyframes at any rate again";
  return {};
}

void WantedPace::look(Time now) {
  if (wanted_hz_ != 0 && now - said_at_.load() > lasts_) wanted_hz_ = 0;
}

}  // namespace relmap::workflow
