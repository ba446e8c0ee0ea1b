// The geometry of a simulated world: textured planar polygons.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "proto/geometry/geometry.h"
#include "tools/sim/texture.h"

namespace relmap::sim {

// A convex planar polygon in world coordinates (y down, the ground at y = 0), with an affine map to its texture.
struct Surface {
  std::array<Vector3, 4> corners;
  int corner_count = 0;
  int texture = 0;
  float gain = 1;  // factor for the light that falls on it
  // Plane: normal . p = distance. Texel coordinates: (u . p + u0, v . p + v0).
  Vector3 normal, u, v;
  double distance = 0, u0 = 0, v0 = 0;
};

// Light of clear weather on a surface: from everywhere, and at most from the sun.
inline constexpr double kDiffuseLight = 0.92, kDirectLight = 0.3;

// A surface that the sun lights, the same on both sides. `texels`: texture coordinates of the first three corners; (0,
// 0) is the corner of the texture.
Surface make_surface(std::span<const Vector3> corners, const std::array<Vector2, 3>& texels, int texture);
Surface moved(Surface surface, const SE3& motion);

// A surface that moves, at one instant.
struct MovingSurface {
  Surface surface;
  Vector3 velocity;  // m/s, in the world; it turns slowly if at all
};

struct Scene {
  std::vector<Surface> surfaces;
  std::vector<Texture> textures;  // also those of moving surfaces
};

// All surfaces at one instant.
struct Snapshot {
  const Scene& scene;
  std::vector<MovingSurface> moving;

  std::size_t size() const { return scene.surfaces.size() + moving.size(); }
  // The moving ones come last.
  bool is_moving(std::size_t k) const { return k >= scene.surfaces.size(); }
  const MovingSurface& moving_surface(std::size_t k) const { return moving[k - scene.surfaces.size()]; }
  const Surface& surface(std::size_t k) const { return is_moving(k) ? moving_surface(k).surface : scene.surfaces[k]; }
};

}  // namespace relmap::sim
