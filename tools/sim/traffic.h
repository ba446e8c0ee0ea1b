// The other cars on a simulated motorway.
#pragma once

#include <array>
#include <vector>

#include "tools/sim/circuit.h"
#include "tools/sim/random.h"
#include "tools/sim/scene.h"

namespace relmap::sim {

// Cars keep their lanes and speeds, which are near the usual one of the lane; the two in the camera's lane have its
// speed.
class Traffic {
 public:
  // `speed`: of the camera, m/s. The textures are added to the scene.
  Traffic(const Circuit& circuit, double speed, Scene& scene, Random random);

  // The cars within sight of a place in the plan.
  std::vector<MovingSurface> near(const Vector2& place, double seconds) const;

 private:
  struct Car {
    int model;
    double lane;   // metres to the right of the circuit
    double start;  // metres along it
    double speed;  // m/s, negative: the opposite direction
  };
  using Model = std::vector<Surface>;  // x to the right, y down, z ahead; the ground at y = 0

  static Model paint_model(Scene& scene, Random& random);

  const Circuit& circuit_;
  std::array<Model, 5> models_;
  std::vector<Car> cars_;
};

}  // namespace relmap::sim
