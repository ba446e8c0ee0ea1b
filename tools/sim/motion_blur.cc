#include "tools/sim/motion_blur.h"

#include <algorithm>
#include <cmath>

namespace relmap::sim {
namespace {

constexpr int kMaxTaps = 33;
// Pixels beyond the picture's border that are rendered too, since the flow carries them in.
constexpr int kBlurMargin = 24;

StereoCamera widened(StereoCamera camera) {
  camera.cx += kBlurMargin;
  camera.cy += kBlurMargin;
  camera.width += 2 * kBlurMargin;
  camera.height += 2 * kBlurMargin;
  return camera;
}

float interpolate(const std::vector<float>& light, const StereoCamera& camera, float u, float v) {
  const float x = std::clamp(u, 0.0F, static_cast<float>(camera.width) - 1.001F);
  const float y = std::clamp(v, 0.0F, static_cast<float>(camera.height) - 1.001F);
  const int column = static_cast<int>(x), row = static_cast<int>(y);
  const float fx = x - static_cast<float>(column), fy = y - static_cast<float>(row);
  const float* p = light.data() + static_cast<std::ptrdiff_t>(row) * camera.width + column;
  const float top = p[0] + fx * (p[1] - p[0]);
  const float bottom = p[camera.width] + fx * (p[camera.width + 1] - p[camera.width]);
  return top + fy * (bottom - top);
}

// The sample of a pixel that sees the nearest surface.
std::size_t nearest_sample(const Visibility& visible, int column, int row) {
  std::size_t nearest = static_cast<std::size_t>(row) * kSamplesPerSide * visible.width + column * kSamplesPerSide;
  const std::size_t first = nearest;
  for (int y = 0; y < kSamplesPerSide; ++y)
    for (int x = 0; x < kSamplesPerSide; ++x) {
      const std::size_t k = first + static_cast<std::size_t>(y) * visible.width + x;
      if (visible.inverse_depth[k] > visible.inverse_depth[nearest]) nearest = k;
    }
  return nearest;
}

}  // namespace

std::vector<float> shade_blurred(const Snapshot& snapshot, const StereoCamera& camera, const MovingEye& eye,
                                 double exposure_s) {
  const StereoCamera wide = widened(camera);
  const Visibility visible = find_visible(snapshot, wide, eye.T_world_eye, kSamplesPerSide);
  const std::vector<float> sharp = shade(snapshot, wide, eye.T_world_eye, visible);
  const Eigen::Vector3f w = eye.angular_velocity.cast<float>();
  const auto velocity_seen = [&](std::int32_t surface) -> Eigen::Vector3f {  // of the eye, from there
    if (surface < 0 || !snapshot.is_moving(surface)) return eye.velocity.cast<float>();
    const Vector3& own = snapshot.moving_surface(surface).velocity;
    return (eye.velocity - eye.T_world_eye.R.transpose() * own).cast<float>();
  };
  const auto f = static_cast<float>(camera.f), exposure = static_cast<float>(exposure_s);
  std::vector<float> picture(static_cast<std::size_t>(camera.width) * camera.height);
  for (int row = 0; row < camera.height; ++row)
    for (int column = 0; column < camera.width; ++column) {
      const int u = column + kBlurMargin, r = row + kBlurMargin;
      const Eigen::Vector3f ray(static_cast<float>(column - camera.cx) / f, static_cast<float>(row - camera.cy) / f, 1);
      const std::size_t sample = nearest_sample(visible, u, r);
      const Eigen::Vector3f v = velocity_seen(visible.surface[sample]);
      const Eigen::Vector3f motion = -(visible.inverse_depth[sample] * v + w.cross(ray));  // of the point / its depth
      const float du = f * exposure * (motion.x() - ray.x() * motion.z());
      const float dv = f * exposure * (motion.y() - ray.y() * motion.z());
      const int taps = static_cast<int>(std::clamp(std::ceil(std::hypot(du, dv)), 1.0F, static_cast<float>(kMaxTaps)));
      float sum = 0;
      for (int k = 0; k < taps; ++k) {
        const float part = (static_cast<float>(k) + 0.5F) / static_cast<float>(taps) - 0.5F;
        sum += interpolate(sharp, wide, static_cast<float>(u) + part * du, static_cast<float>(r) + part * dv);
      }
      picture[static_cast<std::size_t>(row) * camera.width + column] = sum / static_cast<float>(taps);
    }
  return picture;
}

}  // namespace relmap::sim
