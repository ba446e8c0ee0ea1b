// Statistics of a picture's grey levels, for the tests of the worlds.
#pragma once

#include <cmath>
#include <numeric>

#include "tools/sim/picture_world.h"

namespace relmap::sim {

inline double mean_grey(const GreyPicture& picture) {
  return std::accumulate(picture.pixels.begin(), picture.pixels.end(), 0.0) /
         static_cast<double>(picture.pixels.size());
}

// The share of the blocks of 16 x 16 pixels in rows [top, bottom) whose values differ clearly.
inline double textured_share(const GreyPicture& picture, int top, int bottom) {
  int textured = 0, cells = 0;
  for (int v = top; v + 16 <= bottom; v += 16)
    for (int u = 0; u + 16 <= picture.width; u += 16, ++cells) {
      double sum = 0, squares = 0;
      for (int y = v; y < v + 16; ++y)
        for (int x = u; x < u + 16; ++x) {
          const double value = picture.pixels[static_cast<std::size_t>(y) * picture.width + x];
          sum += value;
          squares += value * value;
        }
      if (std::sqrt(squares / 256 - sum / 256 * sum / 256) > 8) ++textured;
    }
  return static_cast<double>(textured) / cells;
}

}  // namespace relmap::sim
