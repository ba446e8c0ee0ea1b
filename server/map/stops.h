// Stops that are long enough for the robot to have been carried by a lift or a train. To a camera that sees only the
// cabin, a ride looks like standing still.
#pragma once

#include "storage/graph/frame.h"

namespace relmap::map {

// A shorter stop is no ride, since a robot halts for a moment at any corner.
inline constexpr double kMinRideSeconds = 3;  // without interruption

// How long a robot has stood still without interruption, followed step by step in either direction.
class Standing {
 public:
  // Adds a step; returns whether the robot has stood for kMinRideSeconds by now. A closure ends a stand.
  bool is_stop(const storage::Edge& step) {
    const bool stands = step.kind != storage::EdgeKind::kLoop && storage::stood(step);
    stood_s_ = stands ? stood_s_ + double{step.standing_s} : 0;
    return stood_s_ >= kMinRideSeconds;
  }
  // Adds a step along which it was certainly not carried.
  void interrupt() { stood_s_ = 0; }
  bool is_standing() const { return stood_s_ > 0; }

 private:
  double stood_s_ = 0;
};

}  // namespace relmap::map
