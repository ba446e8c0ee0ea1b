// The carrier of a robot: the cabin of a lift, a wagon, or the steps of an escalator.
#pragma once

#include <vector>

#include "tools/sim/itinerary.h"
#include "tools/sim/random.h"
#include "tools/sim/road.h"
#include "tools/sim/scene.h"

namespace relmap::sim {

inline constexpr double kCabinBack = 1.5, kCabinFront = 2.4;  // metres: cabin behind and in front of the robot
inline constexpr double kBeltBack = 2, kBeltFront = 3;  // metres: belt before the start and after the end of a ride

// A lift has two door leaves in front of the robot. A wagon has side walls, seats and a roof, and is open in front and
// behind. The steps of an escalator carry its side walls; they are level at both ends.
class Carrier {
 public:
  // The textures are added to `scene`. `options`, `itinerary` and `road` must outlive the carrier.
  Carrier(const PictureWorldOptions& options, const Itinerary& itinerary, const Road& road, Scene& scene,
          Random random);

  std::vector<MovingSurface> at(double seconds) const;

 private:
  // Rigid, in the coordinates of the road below: x to the right, y down, z ahead.
  using Part = std::vector<Surface>;
  void build_lift(Scene& scene, Random& random);
  void build_wagon(Scene& scene, Random& random);
  void build_steps(Scene& scene, Random& random);
  // The surfaces that exist at `seconds`, at their places `later` seconds after that.
  std::vector<Surface> placed(double seconds, double later) const;

  const RideKind kind_;
  const Slope belt_;
  const Itinerary& itinerary_;
  const Road& road_;
  std::vector<Part> parts_;  // the cabin, and for a lift the left and right leaf; or the steps
};

}  // namespace relmap::sim
