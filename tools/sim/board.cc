#include "tools/sim/board.h"

#include <array>
#include <cmath>

#include "tools/sim/street_textures.h"

namespace relmap::sim {
namespace {

constexpr double kDistance = 2.5, kSway = 0.3;           // metres
constexpr double kSpeed = 0.5, kPeriod = 3;              // m/s, seconds
constexpr double kWidthShare = 0.5, kHeightShare = 0.6;  // of the picture

}  // namespace

Board::Board(const StereoCamera& camera, Scene& scene, Random random) {
  const double width = kWidthShare * camera.width * kDistance / camera.f;
  const double height = kHeightShare * camera.height * kDistance / camera.f;
  const double x = width / 2, y = height / 2;
  const std::array<Vector3, 4> corners{Vector3(-x, -y, 0), Vector3(x, -y, 0), Vector3(x, y, 0), Vector3(-x, y, 0)};
  scene.textures.emplace_back(paint_poster_row(width, height, random));
  surface_ =
      make_surface(corners, {Vector2(0, 0), kPropTexels * Vector2(width, 0), kPropTexels * Vector2(width, height)},
                   static_cast<int>(scene.textures.size()) - 1);
}

MovingSurface Board::at(double seconds, const Motion& motion) const {
  const double phase = 2 * M_PI * seconds / kPeriod;
  const SE3 T_left_board{so3_exp(Vector3(0, 0.15 * std::sin(phase), 0)),
                         Vector3(kSpeed * (seconds - kPeriod / 2), 0, kDistance + kSway * std::sin(phase))};
  const Vector3 seen(kSpeed, 0, kSway * std::cos(phase) * 2 * M_PI / kPeriod);
  const Matrix3& R = motion.T_world_left.R;
  return {moved(surface_, motion.T_world_left * T_left_board),
          motion.velocity + R * (motion.angular_velocity.cross(T_left_board.t) + seen)};
}

}  // namespace relmap::sim
