#include "tools/sim/scene_builder.h"

#include <cmath>

namespace relmap::sim {

std::vector<Vector2> SceneBuilder::box_plan(const Vector2& middle, double width, double depth, double turn) {
  const Vector2 a(std::cos(turn) * width / 2, std::sin(turn) * width / 2);
  const Vector2 b(-std::sin(turn) * depth / 2, std::cos(turn) * depth / 2);
  return {middle - a - b, middle + a - b, middle + a + b, middle - a + b};
}

std::vector<Vector2> SceneBuilder::round_plan(const Vector2& middle, double radius, int corners) {
  std::vector<Vector2> plan;
  for (int k = 0; k < corners; ++k) {
    const double angle = 2 * M_PI * k / corners;
    plan.push_back(middle + radius * Vector2(std::cos(angle), std::sin(angle)));
  }
  return plan;
}

int SceneBuilder::texture(const Canvas& canvas) {
  scene_.textures.emplace_back(canvas);
  return static_cast<int>(scene_.textures.size()) - 1;
}

void SceneBuilder::polygon(std::span<const Vector3> corners, const std::array<Vector2, 3>& texels, int texture_index) {
  scene_.surfaces.push_back(make_surface(corners, texels, texture_index));
}

void SceneBuilder::panel(const Vector3& corner, const Vector3& across, const Vector3& down, int texture_index,
                         double texels, double from) {
  const std::array<Vector3, 4> corners{corner, corner + across, corner + across + down, corner + down};
  const double left = from * texels, right = (from + across.norm()) * texels, bottom = down.norm() * texels;
  polygon(corners, {Vector2(left, 0), Vector2(right, 0), Vector2(right, bottom)}, texture_index);
}

void SceneBuilder::wall(const Vector2& from, const Vector2& to, double height, double foot, int texture_index,
                        double texels, double start) {
  panel(lift(from, height), lift(to, height) - lift(from, height), Vector3(0, height - foot, 0), texture_index, texels,
        start);
}

void SceneBuilder::prism(const std::vector<Vector2>& plan, double foot, double height, int sides, double texels) {
  double start = 0;
  for (std::size_t k = 0; k < plan.size(); ++k) {
    const Vector2 &a = plan[k], &b = plan[(k + 1) % plan.size()];
    wall(a, b, height, foot, sides, texels, start);
    start += (b - a).norm();
  }
  for (const double level : {foot, height})
    for (std::size_t k = 1; k + 1 < plan.size(); ++k) {
      const std::array<Vector3, 3> lid{lift(plan[0], level), lift(plan[k], level), lift(plan[k + 1], level)};
      polygon(lid, {Vector2(0, 0), texels * (plan[k] - plan[0]), texels * (plan[k + 1] - plan[0])}, sides);
    }
}

}  // namespace relmap::sim
