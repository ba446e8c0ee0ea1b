// How sharp a picture is: the width of its edges.
#pragma once

#include <optional>

#include "frontend/vision/image.h"

namespace relmap::vision {

// Pixels: the contrast of an edge by its steepest slope, which no exposure changes; of a step blurred by a Gaussian of
// s pixels sqrt(2 pi) s, and 2 for a step from one pixel to the next. That of the sharpest fifth of the strong edges,
// along rows and columns, since every scene has soft ones besides, and motion blurs in one direction. Edges that reach
// white or black, where they are cut off, do not count. Nothing where fewer than 50 strong edges are.
std::optional<double> edge_width(ImageView picture);

}  // namespace relmap::vision
