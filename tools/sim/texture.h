// A grey texture with its mip levels.
#pragma once

#include <cstdint>
#include <vector>

#include "tools/sim/canvas.h"

namespace relmap::sim {

// Level k is the box-filtered picture at 2^-k of the resolution. Sides are multiples of 2^kTopLevel, so that all levels
// halve exactly.
class Texture {
 public:
  static constexpr int kTopLevel = 6;

  explicit Texture(const Canvas& canvas);

  struct Level {
    int width = 0;
    int height = 0;
    float scale = 1;               // of level 0's texels
    float last_x = 0, last_y = 0;  // largest coordinates that are sampled
    std::vector<std::uint8_t> pixels;
  };
  // (u, v) in texels of level 0, texel centres at whole numbers; clamped at the border. `level` in 0..kTopLevel.
  float sample(float u, float v, int level) const {
    const Level& l = levels_[level];
    const float x = clamp((u + 0.5F) * l.scale - 0.5F, l.last_x);
    const float y = clamp((v + 0.5F) * l.scale - 0.5F, l.last_y);
    const int xi = static_cast<int>(x), yi = static_cast<int>(y);
    const float fx = x - static_cast<float>(xi), fy = y - static_cast<float>(yi);
    const std::uint8_t* p = l.pixels.data() + static_cast<std::ptrdiff_t>(yi) * l.width + xi;
    const float top = static_cast<float>(p[0]) + fx * static_cast<float>(p[1] - p[0]);
    const float bottom = static_cast<float>(p[l.width]) + fx * static_cast<float>(p[l.width + 1] - p[l.width]);
    return top + fy * (bottom - top);
  }

 private:
  static float clamp(float x, float high) { return x > 0 ? (x < high ? x : high) : 0; }
  std::vector<Level> levels_;
};

}  // namespace relmap::sim
