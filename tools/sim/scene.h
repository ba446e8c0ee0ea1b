// The geometry of a simulated world: textured planar polygons.
#pragma once

#include <array>
#include <vector>

#include "proto/geometry.h"
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

struct Scene {
  std::vector<Surface> surfaces;
  std::vector<Texture> textures;
};

}  // namespace relmap::sim
