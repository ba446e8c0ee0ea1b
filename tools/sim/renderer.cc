#include "tools/sim/renderer.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

namespace relmap::sim {
namespace {

constexpr double kNear = 0.1;  // metres
constexpr int kFactor = kSamplesPerSide;

// A linear function of the sample's column and row.
struct Linear {
  float x = 0, y = 0, constant = 0;
  float at(float column, float row) const { return x * column + y * row + constant; }
};

// Of a camera whose picture is a grid of samples: column X looks along ((X - cx)/f, (Y - cy)/f, 1).
struct Grid {
  double f, cx, cy;
  int width, height;
  Grid(const StereoCamera& camera, int factor)
      : f(camera.f * factor),
        cx((camera.cx + 0.5) * factor - 0.5),
        cy((camera.cy + 0.5) * factor - 0.5),
        width(camera.width * factor),
        height(camera.height * factor) {}
  // a . ray + constant/z, as a function of the sample; both are linear once divided by z.
  Linear along_ray(const Vector3& a) const {
    return {static_cast<float>(a.x() / f), static_cast<float>(a.y() / f),
            static_cast<float>(a.z() - (a.x() * cx + a.y() * cy) / f)};
  }
};

Linear inverse_depth_of(const Surface& s, const SE3& T_world_eye, const Grid& grid) {
  const double distance = s.distance - s.normal.dot(T_world_eye.t);
  if (std::abs(distance) < 1e-9) return {};  // seen edge on
  return grid.along_ray(T_world_eye.R.transpose() * s.normal / distance);
}

struct Corner {
  double x, y;  // in samples
};

// The polygon cut at the near plane and projected; at most five corners.
int project(const Surface& s, const SE3& T_eye_world, const Grid& grid, std::array<Corner, 6>& out) {
  std::array<Vector3, 4> p;
  for (int k = 0; k < s.corner_count; ++k) p[k] = T_eye_world * s.corners[k];
  int count = 0;
  const auto add = [&](const Vector3& q) {
    out[count++] = {grid.f * q.x() / q.z() + grid.cx, grid.f * q.y() / q.z() + grid.cy};
  };
  for (int k = 0; k < s.corner_count; ++k) {
    const Vector3 &a = p[k], &b = p[(k + 1) % s.corner_count];
    if (a.z() >= kNear) add(a);
    if ((a.z() >= kNear) != (b.z() >= kNear)) add(a + (b - a) * ((kNear - a.z()) / (b.z() - a.z())));
  }
  return count;
}

void draw(const std::array<Corner, 6>& corners, int count, const Linear& inverse_depth, int surface, Visibility& out) {
  double top = corners[0].y, bottom = top;
  for (int k = 1; k < count; ++k) {
    top = std::min(top, corners[k].y);
    bottom = std::max(bottom, corners[k].y);
  }
  const int first = static_cast<int>(std::max(0.0, std::ceil(top)));
  const int last = static_cast<int>(std::min(out.height - 1.0, std::ceil(bottom) - 1));
  for (int row = first; row <= last; ++row) {
    double left = 1e30, right = -1e30;
    for (int k = 0; k < count; ++k) {
      const Corner &a = corners[k], &b = corners[k + 1 == count ? 0 : k + 1];
      if ((a.y <= row) == (b.y <= row)) continue;
      const double x = a.x + (b.x - a.x) * (row - a.y) / (b.y - a.y);
      left = std::min(left, x);
      right = std::max(right, x);
    }
    if (!(left < right)) continue;
    const int begin = static_cast<int>(std::clamp(std::ceil(left), 0.0, static_cast<double>(out.width)));
    const int end = static_cast<int>(std::clamp(std::ceil(right), 0.0, static_cast<double>(out.width)));
    float* depth = out.inverse_depth.data() + static_cast<std::ptrdiff_t>(row) * out.width;
    std::int32_t* seen = out.surface.data() + static_cast<std::ptrdiff_t>(row) * out.width;
    const float start = inverse_depth.at(0, static_cast<float>(row));
    for (int x = begin; x < end; ++x) {  // without branches: the compiler makes vectors of it
      const float w = start + inverse_depth.x * static_cast<float>(x);
      const bool nearer = w > depth[x];
      depth[x] = nearer ? w : depth[x];
      seen[x] = nearer ? surface : seen[x];
    }
  }
}

float fast_log2(float x) {  // within 0.09: enough to choose a mip level
  const auto bits = std::bit_cast<std::uint32_t>(x);
  return static_cast<float>(bits) * (1.0F / (1 << 23)) - 127.0F;
}

// How a surface is textured in one view: u/z and v/z are linear in the sample, as 1/z is.
struct Shading {
  Linear inverse_depth, u, v;
  const Texture* texture = nullptr;
  float gain = 1;

  // Twice the mip level at which a step of one sample is a texel: the mean of both directions' logarithms, since the
  // four samples of a pixel bear some aliasing along the longer one.
  float twice_level(float w, float u_over_w, float v_over_w) const {
    const float ux = u.x - u_over_w * inverse_depth.x, vx = v.x - v_over_w * inverse_depth.x;
    const float uy = u.y - u_over_w * inverse_depth.y, vy = v.y - v_over_w * inverse_depth.y;
    const float inverse = 1 / (w * w);
    const float a = (ux * ux + vx * vx) * inverse, b = (uy * uy + vy * vy) * inverse;
    return 0.5F * (fast_log2(a + 1e-12F) + fast_log2(b + 1e-12F));
  }
};

}  // namespace

Visibility find_visible(const Snapshot& snapshot, const StereoCamera& camera, const SE3& T_world_eye, int factor) {
  const Grid grid(camera, factor);
  Visibility out;
  out.width = grid.width;
  out.height = grid.height;
  const std::size_t samples = static_cast<std::size_t>(grid.width) * grid.height;
  out.inverse_depth.assign(samples, 0.0F);
  out.surface.assign(samples, -1);
  const SE3 T_eye_world = T_world_eye.inverse();
  for (std::size_t k = 0; k < snapshot.size(); ++k) {
    const Surface& s = snapshot.surface(k);
    std::array<Corner, 6> corners;
    const int count = project(s, T_eye_world, grid, corners);
    if (count >= 3) draw(corners, count, inverse_depth_of(s, T_world_eye, grid), static_cast<int>(k), out);
  }
  return out;
}

std::vector<float> shade(const Snapshot& snapshot, const StereoCamera& camera, const SE3& T_world_eye,
                         const Visibility& visible) {
  const Grid grid(camera, kFactor);
  std::vector<Shading> shading(snapshot.size());
  for (std::size_t k = 0; k < shading.size(); ++k) {
    const Surface& s = snapshot.surface(k);
    Shading& out = shading[k];
    out.inverse_depth = inverse_depth_of(s, T_world_eye, grid);
    const auto over_z = [&](const Vector3& gradient, double constant) {
      const double at_eye = gradient.dot(T_world_eye.t) + constant;
      Linear l = grid.along_ray(T_world_eye.R.transpose() * gradient);
      l.x += static_cast<float>(at_eye * out.inverse_depth.x);
      l.y += static_cast<float>(at_eye * out.inverse_depth.y);
      l.constant += static_cast<float>(at_eye * out.inverse_depth.constant);
      return l;
    };
    out.u = over_z(s.u, s.u0);
    out.v = over_z(s.v, s.v0);
    out.texture = &snapshot.scene.textures[s.texture];
    out.gain = s.gain;
  }
  std::vector<float> picture(static_cast<std::size_t>(camera.width) * camera.height);
  // The four samples take neighbouring mip levels in turn, which stands for the blend between two levels.
  constexpr float kDither[kFactor * kFactor] = {0.0F, 0.5F, 0.75F, 0.25F};
  for (int row = 0; row < camera.height; ++row)
    for (int column = 0; column < camera.width; ++column) {
      float sum = 0, level = 0;
      int level_of = -1;
      for (int k = 0; k < kFactor * kFactor; ++k) {
        const int x = column * kFactor + k % kFactor, y = row * kFactor + k / kFactor;
        const int surface = visible.surface[static_cast<std::size_t>(y) * visible.width + x];
        if (surface < 0) continue;
        const Shading& s = shading[surface];
        const float fx = static_cast<float>(x), fy = static_cast<float>(y);
        const float w = s.inverse_depth.at(fx, fy);
        const float z = 1 / w, u = s.u.at(fx, fy) * z, v = s.v.at(fx, fy) * z;
        if (surface != level_of) {
          level = 0.5F * s.twice_level(w, u, v);
          level_of = surface;
        }
        // Written so that NaN, from a surface seen edge on, gives level 0.
        const float top = Texture::kTopLevel;
        const int mip = static_cast<int>(std::min(std::min(std::max(0.0F, level), top) + kDither[k], top));
        sum += s.gain * s.texture->sample(u, v, mip);
      }
      picture[static_cast<std::size_t>(row) * camera.width + column] = sum / (kFactor * kFactor);
    }
  return picture;
}

}  // namespace relmap::sim
