// Transfers the points of one frame to another by its depth and the truth, to check that both pictures agree with it.
#pragma once

#include <cmath>
#include <cstdlib>
#include <vector>

#include "tools/sim/picture_world.h"

namespace relmap::sim {

struct CarriedPoints {
  int visible = 0;  // points of every `step`-th pixel (in x and y) of `from` that lie within `to`
  int agree = 0;    // those of them that have their depth there; points behind something nearer do not
};

inline CarriedPoints carry_points(const PictureWorld& world, int from, int to, int step) {
  const StereoCamera& camera = world.options().camera;
  const std::vector<float> depth = world.render_depth(from), depth_there = world.render_depth(to);
  const SE3 T = world.truth(to).inverse() * world.truth(from);
  CarriedPoints found;
  for (int v = 5; v < camera.height; v += step)
    for (int u = 5; u < camera.width; u += step) {
      const double z = depth[static_cast<std::size_t>(v) * camera.width + u];
      const Vector3 p = T * Vector3((u - camera.cx) / camera.f * z, (v - camera.cy) / camera.f * z, z);
      const StereoPixel seen = camera.project(p);
      const int x = static_cast<int>(std::lround(seen.x())), y = static_cast<int>(std::lround(seen.y()));
      if (p.z() < 0.5 || x < 0 || y < 0 || x >= camera.width || y >= camera.height) continue;
      ++found.visible;
      found.agree += std::abs(depth_there[static_cast<std::size_t>(y) * camera.width + x] / p.z() - 1) < 0.05;
    }
  return found;
}

}  // namespace relmap::sim
