// Relates the cycle timer of IEEE 1394 (8.3.2.3.1), which wraps every 128 s, to the host's clock.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>

namespace relmap::iidc {

// A cycle time has seconds (7 bits), cycles of 125 us (13 bits) and ticks of 1/24.576 MHz (12 bits).
bool is_cycle_time(std::uint32_t cycle_time);    // false if cycles or ticks are out of range
double cycle_seconds(std::uint32_t cycle_time);  // 0 .. 128

// Estimates offset and drift by a line through the readings of the last two minutes. Readings whose answer took long
// weigh less. Not thread-safe.
class CycleClock {
 public:
  // The timer was read between two times of the host (any monotonic clock, microseconds). Returns false if the reading
  // does not fit the ones before because the camera was reset; the clock then starts over with it.
  bool observe(std::uint32_t cycle_time, std::int64_t before_us, std::int64_t after_us);

  bool ready() const { return !readings_.empty(); }
  // The host's time of a stamp that is at most a minute away from `near_us`. Requires ready().
  std::int64_t host_us(std::uint32_t cycle_time, std::int64_t near_us) const;

  // How much faster the camera's clock runs, in parts per million; nothing until readings span ten seconds.
  std::optional<double> drift_ppm() const;
  // The uncertainty of host_us(): half of the shortest time that the bus took for an answer.
  double uncertainty_us() const;

 private:
  struct Reading {
    double camera_s;  // unwrapped, since the first reading
    double host_s;    // since the first reading
    double doubt_s;   // half of the time that the answer took
  };
  void fit();

  std::deque<Reading> readings_;
  std::int64_t first_host_us_ = 0;
  double first_camera_s_ = 0;  // not unwrapped
  // host_s = offset_ + rate_ * camera_s
  double offset_ = 0, rate_ = 1;
};

}  // namespace relmap::iidc
