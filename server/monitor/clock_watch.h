// Notices steps of the system's clock: time stamps of keyframes and the lag of robots are then wrong by as much, and so
// are the times in logs.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>

namespace relmap::monitor {

class ClockWatch {
 public:
  // Seconds of the time of day, and of a clock that nobody sets and that goes on while the machine sleeps.
  struct Times {
    double day_s = 0, steady_s = 0;
  };
  using Clocks = std::function<Times()>;
  static Times system_clocks();

  explicit ClockWatch(Clocks clocks = system_clocks);

  // Compares the clocks with what they showed at the last look. A step is more than this.
  static constexpr double kStep_s = 1;
  // One thread looks. True, and a line in the log, if the clock was set by more than kStep_s since the last look.
  bool look();

  // Thread-safe.
  std::uint64_t steps() const { return steps_; }
  double last_step_s() const { return last_step_s_; }  // forward is positive; 0: there was none
  double last_step_age_s() const;                      // seconds since it was noticed; 0: there was none

 private:
  const Clocks clocks_;
  double ahead_s_;  // of the time of day, at the last look
  std::atomic<std::uint64_t> steps_ = 0;
  std::atomic<double> last_step_s_ = 0;
  std::atomic<double> last_step_at_s_ = 0;  // of the steady clock
};

}  // namespace relmap::monitor
