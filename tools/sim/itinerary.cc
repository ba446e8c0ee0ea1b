#include "tools/sim/itinerary.h"

#include <algorithm>
#include <cmath>

#include "tools/sim/road.h"

namespace relmap::sim {
namespace {

constexpr double kPullAway = 1;                  // seconds until the robot is as fast as it gets, and until it stands
constexpr double kWait = 2;                      // in what carries it, before it moves and behind
constexpr double kDoorDelay = 0.4, kDoor = 1.2;  // seconds
constexpr double kCarrierPullAway = 1.2;         // seconds
constexpr double kBeyond = 12;                   // metres of its first way that it sees again

}  // namespace

double eased(double x, double whole, double ramp) {
  const double rate = 1 / (whole - ramp);
  if (x <= 0) return 0;
  if (x >= whole) return 1;
  if (x < ramp) return 0.5 * rate * x * x / ramp;
  if (x > whole - ramp) return 1 - 0.5 * rate * (whole - x) * (whole - x) / ramp;
  return rate * (x - 0.5 * ramp);
}

Itinerary::Itinerary(const PictureWorldOptions& o) : speed_(o.step * o.rate), carried_(o.carried) {
  const double round = o.ride_way;
  switch (o.ride) {
    case RideKind::kNone:
      drive(round);
      break;
    case RideKind::kLift:
    case RideKind::kLiftAlike: {
      const double lift = lift_place(o);
      drive(lift);
      ride(lift, kStorey, 1.2);
      drive(lift + round);
      ride(lift + round, -kStorey, 1.2);
      drive(2 * round + kBeyond);
      break;
    }
    case RideKind::kLiftRamp:
      drive(round);
      ride(round, -kStorey, 1.2);
      drive(round + kBeyond);
      break;
    case RideKind::kTrain:
      drive(round / 2);
      ride(round / 2 + 12, 0, 3);
      drive(round + kBeyond);
      break;
    case RideKind::kEscalator: {
      const Slope escalator = escalator_place(o);
      drive(escalator.from);
      ride(escalator.to, 0, 1.2);
      drive(round + kBeyond);
      break;
    }
    case RideKind::kAlike:
      drive(0.4 * round);
      ride(0.4 * round, 0, 1.2);
      drive(round + kBeyond);
      break;
  }
}

void Itinerary::drive(double to) {
  const double from = legs_.empty() ? 0 : legs_.back().to;
  Leg leg;
  if (!legs_.empty()) {
    const Leg& before = legs_.back();
    leg.begin = before.end;
    leg.level = before.level + before.lift;
    leg.driven = before.driven + (before.ride ? 0 : before.to - before.from);
  }
  leg.from = from;
  leg.to = to;
  leg.end = leg.begin + (to - from) / speed_ + kPullAway;
  legs_.push_back(leg);
}

void Itinerary::ride(double alight, double lift, double speed) {
  const Leg& before = legs_.back();
  Leg leg;
  leg.ride = true;
  leg.begin = before.end;
  leg.level = before.level;
  leg.driven = before.driven + before.to - before.from;
  const double metres = std::hypot(alight - before.to, lift) + (alight == before.to && lift == 0 ? kStorey : 0);
  leg.end = leg.begin + 2 * kWait + metres / speed + kCarrierPullAway;
  leg.from = before.to;
  leg.to = carried_ ? alight : leg.from;
  leg.lift = carried_ ? lift : 0;
  rides_.push_back({leg.from, leg.to, leg.lift});
  legs_.push_back(leg);
}

Itinerary::State Itinerary::at(double t) const {
  State out;
  const Leg* carrier = nullptr;  // the ride that is on, or else was the last, or else will be the first
  for (const Leg& leg : legs_)
    if (leg.ride && (!carrier || leg.begin <= t)) carrier = &leg;
  const auto moved = [&](const Leg& leg) {
    return eased(t - leg.begin - kWait, leg.end - leg.begin - 2 * kWait, kCarrierPullAway);
  };
  if (carrier) {
    out.carrier_way = carrier->from + moved(*carrier) * (carrier->to - carrier->from);
    out.carrier_level = carrier->level + moved(*carrier) * carrier->lift;
    const auto closed = [](double since) { return std::clamp(since / kDoor, 0.0, 1.0); };
    out.doors = closed(t - carrier->begin - kDoorDelay) - closed(t - carrier->end + kWait - kDoorDelay);
  }
  for (const Leg& leg : legs_) {
    if (t < leg.begin && &leg != &legs_.front()) break;
    const double share = leg.ride ? moved(leg) : eased(t - leg.begin, leg.end - leg.begin, kPullAway);
    out.way = leg.from + share * (leg.to - leg.from);
    out.level = leg.level + share * leg.lift;
    out.driven = leg.driven + (leg.ride ? 0 : share * (leg.to - leg.from));
    out.riding = leg.ride && t >= leg.begin && t <= leg.end;
    out.carried = out.riding && share > 0 && share < 1 && (leg.to != leg.from || leg.lift != 0);
  }
  return out;
}

}  // namespace relmap::sim
