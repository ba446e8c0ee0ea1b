// Time spent driving and time spent standing (slower than 0.05 m/s), from poses.
#pragma once

#include <cstdint>
#include <deque>

#include "proto/geometry/geometry.h"

namespace relmap::tracking {

inline constexpr double kStandingSpeed = 0.05;  // m/s

// The speed is measured over at least the last half second: between consecutive pictures, noise of millimetres would
// look like motion.
class Speedometer {
 public:
  void add(std::int64_t time_us, const Vector3& position);

  double speed() const { return speed_; }  // m/s
  std::int64_t driven_us() const { return driven_us_; }
  std::int64_t standing_us() const { return standing_us_; }
  // Resets both times; called at each keyframe.
  void restart() { driven_us_ = standing_us_ = 0; }

 private:
  struct Entry {
    std::int64_t time_us;
    Vector3 position;
  };
  std::deque<Entry> entries_;
  double speed_ = 0;
  std::int64_t driven_us_ = 0, standing_us_ = 0;
};

}  // namespace relmap::tracking
