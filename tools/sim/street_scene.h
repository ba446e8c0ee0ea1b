// The geometry of a simulated world: textured planar polygons round a circuit.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "proto/geometry.h"
#include "tools/sim/circuit.h"
#include "tools/sim/texture.h"

namespace relmap::sim {

// A convex planar polygon in world coordinates (y down, the ground at y = 0), with an affine map to its texture.
struct Surface {
  std::array<Vector3, 4> corners;
  int corner_count = 0;
  int texture = 0;
  float gain = 1;  // of the light that falls on it
  // Plane: normal . p = distance. Texel coordinates: (u . p + u0, v . p + v0).
  Vector3 normal, u, v;
  double distance = 0, u0 = 0, v0 = 0;
};

class StreetScene {
 public:
  // A street along the circuit: closed rows of houses on both sides, ground, sky, and things on the pavements. What is
  // nearer to the road's middle than clearance() is free.
  StreetScene(const Circuit& circuit, std::uint64_t seed);

  const std::vector<Surface>& surfaces() const { return surfaces_; }
  const Texture& texture(int index) const { return textures_[index]; }
  static constexpr double clearance() { return 1.0; }  // metres

 private:
  friend class StreetBuilder;
  std::vector<Surface> surfaces_;
  std::vector<Texture> textures_;
};

}  // namespace relmap::sim
