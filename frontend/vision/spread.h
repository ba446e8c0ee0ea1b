// Which corners to start tracks at, so that tracks cover the picture evenly.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "frontend/vision/corners.h"

namespace relmap::vision {

struct PicturePoint {
  float x = 0, y = 0;
};

// A quad-tree over one level: each node asks its quarters for equal shares of the `wanted` points, counts those
// `taken` already, fills up with the candidates of the highest scores, and hands on what a quarter cannot give to the
// others. Returns indices into `candidates`, by falling score; never more than wanted - taken. Candidates nearer than
// `distance` pixels to a taken point or to a chosen one are left out.
std::vector<std::uint32_t> choose_spread(std::span<const Corner> candidates, std::span<const PicturePoint> taken,
                                         int width, int height, int wanted, float distance);

}  // namespace relmap::vision
