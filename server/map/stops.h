// Stops that are long enough for the robot to have been carried by a lift or a train. To a camera that sees only the
// cabin, a ride looks like standing still.
#pragma once

namespace relmap::map {

// A shorter stop is no ride, since a robot halts for a moment at any corner.
inline constexpr double kMinRideSeconds = 3;  // without interruption

}  // namespace relmap::map
