// Chooses the corners at which tracks start, so that tracks cover the picture evenly.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "frontend/vision/corners.h"

namespace relmap::vision {

struct PicturePoint {
  float x = 0, y = 0;
};

// Chooses candidates by a quad-tree over one level of width x height pixels. Each node of the tree divides the `wanted`
// points equally among its quarters; points that are `taken` already count. A quarter is filled with the candidates of
// the highest scores, and what it lacks is given to the other quarters. Candidates nearer than `distance` pixels to a
// taken or a chosen point are left out. Returns indices into `candidates`, by falling score; at most `wanted` less the
// number of taken points.
std::vector<std::uint32_t> choose_spread(std::span<const Corner> candidates, std::span<const PicturePoint> taken,
                                         int width, int height, int wanted, float distance);

}  // namespace relmap::vision
