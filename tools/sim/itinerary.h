// Of a drive with rides: what the robot drives, where it stands, and how it is carried, in time.
#pragma once

#include <vector>

#include "tools/sim/picture_world_options.h"

namespace relmap::sim {

// From 0 to 1 while x goes from 0 to `whole`, at a steady rate but for `ramp` at either end.
double eased(double x, double whole, double ramp);

// Where the lift, the wagon or the escalator takes the robot in and lets it out: metres along the road; and how much
// higher that is than the road itself tells.
struct Ride {
  double board, alight;
  double lift;  // metres
};

// Each leg is a part of the road that is driven, or a ride.
class Itinerary {
 public:
  explicit Itinerary(const PictureWorldOptions& options);  // of a ride; `frames` is not looked at

  struct State {
    double way = 0;     // metres along the road
    double level = 0;   // metres above it
    double driven = 0;  // metres by itself
    // What carries it: where it is, and how far its doors are closed (0 .. 1).
    double carrier_way = 0, carrier_level = 0, doors = 0;
    bool riding = false;   // it stands in what carries it, from the first moment to the last
    bool carried = false;  // that moves
  };
  // Seconds since the start. Before it the robot stands at its start, and behind seconds() at its end.
  State at(double seconds) const;
  double seconds() const { return legs_.back().end; }
  const std::vector<Ride>& rides() const { return rides_; }

 private:
  struct Leg {
    bool ride = false;
    double begin = 0, end = 0;   // seconds
    double from = 0, to = 0;     // metres along the road
    double level = 0, lift = 0;  // metres: above the road, and what the ride adds
    double driven = 0;           // metres before
  };
  void drive(double to);
  void ride(double alight, double lift, double speed);

  double speed_;
  bool carried_;
  std::vector<Leg> legs_;
  std::vector<Ride> rides_;
};

}  // namespace relmap::sim
