// Base of the builders of scenes: polygons, walls, boxes.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "tools/sim/canvas.h"
#include "tools/sim/scene.h"

namespace relmap::sim {

// Plan coordinates are (x, z) of the world; heights and feet are metres above the ground.
class SceneBuilder {
 protected:
  static Vector3 lift(const Vector2& plan, double height) { return {plan.x(), -height, plan.y()}; }
  static std::vector<Vector2> box_plan(const Vector2& middle, double width, double depth, double turn);
  static std::vector<Vector2> round_plan(const Vector2& middle, double radius, int corners);

  int texture(const Canvas& canvas);  // its index
  void polygon(std::span<const Vector3> corners, const std::array<Vector2, 3>& texels, int texture_index);
  // A rectangle. The top left corner of its texture is at `corner`, shifted to the right by `from` metres.
  void panel(const Vector3& corner, const Vector3& across, const Vector3& down, int texture_index, double texels,
             double from = 0);
  void wall(const Vector2& from, const Vector2& to, double height, double foot, int texture_index, double texels,
            double start = 0);
  // An upright prism; the side texture runs once round it.
  void prism(const std::vector<Vector2>& plan, double foot, double height, int sides, double texels);

  Scene scene_;
};

}  // namespace relmap::sim
