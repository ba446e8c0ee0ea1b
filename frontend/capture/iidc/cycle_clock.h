// The cycle timer of IEEE 1394 (8.3.2.3.1), which wraps every 128 s, against the host's clock.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>

namespace relmap::iidc {

// Seconds (7 bits), cycles of 125 us (13), ticks of 1/24.576 MHz (12).
bool is_cycle_time(std::uint32_t cycle_time);    // false: cycles or ticks beyond a second's or a cycle's
double cycle_seconds(std::uint32_t cycle_time);  // 0 .. 128

// Offset and drift from pairs of readings, a line through the last two minutes of them. Readings whose answer took
// long say little, and are weighed by it. Not thread-safe.
class CycleClock {
 public:
  // The timer was read between two times of the host (any clock that only rises, microseconds). False: it does not fit
  // those before, and the clock begins anew with it (the camera was reset).
  bool observe(std::uint32_t cycle_time, std::int64_t before_us, std::int64_t after_us);

  bool ready() const { return !readings_.empty(); }
  // The host's time of a stamp that is at most a minute away from `near_us`. ready() only.
  std::int64_t host_us(std::uint32_t cycle_time, std::int64_t near_us) const;

  // How much faster the camera's clock runs, in millionths; nothing until readings span ten seconds.
  std::optional<double> drift_ppm() const;
  // Of a time that host_us() gives, half the shortest answer: what the bus leaves open.
  double uncertainty_us() const;

 private:
  struct Reading {
    double camera_s;  // unwrapped, since the first
    double host_s;    // since the first
    double doubt_s;   // half of the time that the answer took
  };
  void fit();

  std::deque<Reading> readings_;
  std::int64_t first_host_us_ = 0;
  double first_camera_s_ = 0;  // as the timer shows it
  // host_s = offset_ + rate_ * camera_s
  double offset_ = 0, rate_ = 1;
};

}  // namespace relmap::iidc
