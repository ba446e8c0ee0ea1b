// What carries the robot: a lift's cabin, a wagon, the steps of an escalator.
#pragma once

#include <vector>

#include "tools/sim/itinerary.h"
#include "tools/sim/random.h"
#include "tools/sim/road.h"
#include "tools/sim/scene.h"

namespace relmap::sim {

inline constexpr double kCabinBack = 1.5, kCabinFront = 2.4;  // metres of a lift behind and before the robot
inline constexpr double kBeltBack = 2, kBeltFront = 3;        // of an escalator, before and behind the ride's ends

// The lift is closed by two leaves before the robot. The wagon has side walls, seats and a roof, and is open before and
// behind. The steps of the escalator bear its side walls; they are flat at both ends.
class Carrier {
 public:
  // The textures are added to the scene. All must outlive it but the scene.
  Carrier(const PictureWorldOptions& options, const Itinerary& itinerary, const Road& road, Scene& scene,
          Random random);

  std::vector<MovingSurface> at(double seconds) const;

 private:
  // Rigid, in the coordinates of the road below: x to the right, y down, z ahead.
  using Part = std::vector<Surface>;
  void build_lift(Scene& scene, Random& random);
  void build_wagon(Scene& scene, Random& random);
  void build_steps(Scene& scene, Random& random);
  // Those there are at `seconds`, where they are a little later.
  std::vector<Surface> placed(double seconds, double later) const;

  const RideKind kind_;
  const Slope belt_;
  const Itinerary& itinerary_;
  const Road& road_;
  std::vector<Part> parts_;  // the cabin, and a lift's left and right leaf; or the steps
};

}  // namespace relmap::sim
