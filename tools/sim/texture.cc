#include "tools/sim/texture.h"

#include <algorithm>
#include <cmath>

namespace relmap::sim {

Texture::Texture(const Canvas& canvas) {
  constexpr int kUnit = 1 << kTopLevel;
  const auto whole = [](int n) { return std::max(2, (n + kUnit - 1) / kUnit) * kUnit; };
  levels_.resize(kTopLevel + 1);
  Level& base = levels_[0];
  base.width = whole(canvas.width());
  base.height = whole(canvas.height());
  base.pixels.resize(static_cast<std::size_t>(base.width) * base.height);
  for (int y = 0; y < base.height; ++y)
    for (int x = 0; x < base.width; ++x) {
      const float value = canvas.at(std::min(x, canvas.width() - 1), std::min(y, canvas.height() - 1));
      base.pixels[static_cast<std::size_t>(y) * base.width + x] =
          static_cast<std::uint8_t>(std::clamp(value + 0.5F, 0.0F, 255.0F));
    }
  for (int k = 1; k <= kTopLevel; ++k) {
    const Level& fine = levels_[k - 1];
    Level& coarse = levels_[k];
    coarse.width = fine.width / 2;
    coarse.height = fine.height / 2;
    coarse.pixels.resize(static_cast<std::size_t>(coarse.width) * coarse.height);
    for (int y = 0; y < coarse.height; ++y) {
      const std::uint8_t* row = fine.pixels.data() + static_cast<std::ptrdiff_t>(2 * y) * fine.width;
      std::uint8_t* out = coarse.pixels.data() + static_cast<std::ptrdiff_t>(y) * coarse.width;
      for (int x = 0; x < coarse.width; ++x) {
        const std::uint8_t* p = row + 2 * x;
        out[x] = static_cast<std::uint8_t>((p[0] + p[1] + p[fine.width] + p[fine.width + 1] + 2) / 4);
      }
    }
  }
  for (int k = 0; k <= kTopLevel; ++k) {
    Level& l = levels_[k];
    l.scale = 1.0F / static_cast<float>(1 << k);
    l.last_x = static_cast<float>(l.width) - 1.001F;
    l.last_y = static_cast<float>(l.height) - 1.001F;
  }
}

}  // namespace relmap::sim
