// The timetable of a drive with rides: when the robot drives, stands, and is carried.
#pragma once

#include <vector>

#include "tools/sim/picture_world_options.h"

namespace relmap::sim {

// Rises from 0 to 1 while x goes from 0 to `whole`, at a constant rate except within `ramp` of either end.
double eased(double x, double whole, double ramp);

// A ride by lift, wagon or escalator.
struct Ride {
  double board, alight;  // where the robot boards and alights, metres along the road
  double lift;           // metres by which the ride raises the robot more than the road does
};

// Each leg is a part of the road that is driven, or a ride.
class Itinerary {
 public:
  explicit Itinerary(const PictureWorldOptions& options);  // options of a ride; `frames` is ignored

  struct State {
    double way = 0;     // metres along the road
    double level = 0;   // metres above the road
    double driven = 0;  // metres that the robot has driven itself
    // The place of the carrier, and how far its doors are closed (0 to 1).
    double carrier_way = 0, carrier_level = 0, doors = 0;
    bool riding = false;   // the robot is in the carrier, which may stand
    bool carried = false;  // the carrier moves with the robot
  };
  // The state `seconds` after the start. Before 0 the robot stands at the start, and after seconds() at the end.
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
