// A textured wall in front of a stereo camera: the exact pixel of each of its points is known.
#pragma once

#include <functional>
#include <memory>
#include <random>
#include <utility>

#include "frontend/tracking/pair.h"
#include "frontend/vision/textures_for_test.h"
#include "proto/geometry/camera.h"
#include "proto/geometry/geometry.h"

namespace relmap::tracking::testing_wall {

inline const StereoCamera kCamera{300, 159.5, 119.5, 0.12, 320, 240};

// An upright wall, 3 m in front of the camera at the identity.
class Wall {
 public:
  static constexpr double kDepth = 3;  // 12 pixels of disparity

  // Maps a point of the wall to the position in the texture that is painted there, in metres. It is the identity,
  // unless the wall repeats or has moved.
  using PaintedFrom = std::function<Vector2(const Vector2&)>;

  explicit Wall(
      unsigned seed, PaintedFrom painted_from = [](const Vector2& p) { return p; })
      : waves_(seed, 7, 60), painted_from_(std::move(painted_from)) {}

  // The pair that a camera sees. All disparities are too large by `offset` pixels.
  std::shared_ptr<const Pair> seen(const SE3& T_wall_camera, unsigned noise_seed, double offset = 0) const {
    const SE3 T_left_right{Matrix3::Identity(), {kCamera.baseline, 0, 0}};
    return prepare_pair(eye(T_wall_camera, 2 * noise_seed, 0),
                        eye(T_wall_camera * T_left_right, 2 * noise_seed + 1, offset));
  }

  // The point that the camera at `T_wall_camera` sees at (u, v), in the frame of the camera at the identity.
  static Vector3 point(const SE3& T_wall_camera, double u, double v) {
    const Vector3 ray = T_wall_camera.R * Vector3((u - kCamera.cx) / kCamera.f, (v - kCamera.cy) / kCamera.f, 1);
    return T_wall_camera.t + (kDepth - T_wall_camera.t.z()) / ray.z() * ray;
  }

 private:
  vision::Image eye(const SE3& T_wall_eye, unsigned noise_seed, double shift) const {
    std::mt19937 random(noise_seed);
    std::normal_distribution<float> noise(0, 1);
    return vision::testing_textures::paint(kCamera.width, kCamera.height, [&](int x, int y) {
      const Vector2 p = painted_from_(point(T_wall_eye, x + shift, y).head<2>());
      return waves_.at(100 * p.x(), 100 * p.y()) + noise(random);  // 100 pixels a metre
    });
  }

  vision::testing_textures::Waves waves_;
  PaintedFrom painted_from_;
};

}  // namespace relmap::tracking::testing_wall
