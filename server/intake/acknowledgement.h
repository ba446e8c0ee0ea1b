// Decides when a session's acknowledgement is due: at once when there is news, soon while something is missing, and
// regularly while the robot is active, because acknowledgements may be lost.
#pragma once

#include <chrono>

namespace relmap::intake {

using SteadyTime = std::chrono::steady_clock::time_point;

struct AcknowledgementTimes {
  std::chrono::milliseconds spacing{5};     // minimum time between two acknowledgements
  std::chrono::milliseconds imperfect{40};  // interval while parts or sequences are missing
  std::chrono::milliseconds regular{100};   // interval otherwise
  std::chrono::milliseconds active{5000};   // a robot is active for so long after its last message
};

class AcknowledgementSchedule {
 public:
  explicit AcknowledgementSchedule(AcknowledgementTimes times = {}) : times_(times) {}

  void heard(SteadyTime now) { heard_ = now; }
  void news() { news_ = true; }
  void sent(SteadyTime now) {
    sent_ = now;
    news_ = false;
  }

  SteadyTime last_heard() const { return heard_; }
  // When the next acknowledgement is due; SteadyTime::max() if not before the robot sends something.
  SteadyTime due(bool imperfect) const {
    if (news_) return sent_ + times_.spacing;
    const SteadyTime next = sent_ + (imperfect ? times_.imperfect : times_.regular);
    return next <= heard_ + times_.active ? next : SteadyTime::max();
  }

 private:
  AcknowledgementTimes times_;
  SteadyTime heard_{}, sent_{};
  bool news_ = false;
};

}  // namespace relmap::intake
