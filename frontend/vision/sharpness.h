// Measures how sharp a picture is by the width of its edges.
#pragma once

#include <optional>

#include "frontend/vision/image.h"

namespace relmap::vision {

// Returns the 20th percentile of the widths of the strong edges along rows and columns, in pixels. It is a low
// percentile since every scene also has soft edges, and motion blurs in one direction.
//
// The width of an edge is its contrast divided by its steepest slope, which does not depend on the exposure. For a step
// blurred by a Gaussian of s pixels it is sqrt(2 pi) s, and for a step from one pixel to the next it is 2. Edges that
// reach white or black do not count, since clipping makes them look sharper. Nothing if there are fewer than 50 strong
// edges.
std::optional<double> edge_width(ImageView picture);

}  // namespace relmap::vision
