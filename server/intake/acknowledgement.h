// When a session's acknowledgement is due: at once when there is news; soon while something is missing; now and then
// while the robot is there, because acknowledgements are lost like anything else.
#pragma once

#include <chrono>

namespace relmap::intake {

using SteadyTime = std::chrono::steady_clock::time_point;

struct AcknowledgementTimes {
  std::chrono::milliseconds spacing{5};     // between two, at least
  std::chrono::milliseconds imperfect{40};  // while parts or sequences are missing
  std::chrono::milliseconds regular{100};
  std::chrono::milliseconds active{5000};  // after the robot's last message
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
  // SteadyTime::max() if the robot has to speak first.
  SteadyTime due(bool imperfect) const;

 private:
  AcknowledgementTimes times_;
  SteadyTime heard_{}, sent_{};
  bool news_ = false;
};

}  // namespace relmap::intake
