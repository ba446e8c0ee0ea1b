// Corners that two pictures share, wherever they lie: without trust in a calibration.
#pragma once

#include <vector>

#include "frontend/vision/image.h"

namespace relmap::vision {

struct CornerMatchOptions {
  int wanted = 500;              // corners of the left picture that are looked for
  float columns = 0.35F;         // searched to the left and to the right, of the width
  float rows = 0.12F;            // searched above and below, of the height
  float uniqueness = 0.8F;       // best / second best, of the sums of absolute differences
  float min_correlation = 0.9F;  // after the alignment
};

// Pixels.
struct CornerMatch {
  float u_left = 0, v_left = 0, u_right = 0, v_right = 0;
};

// To a fraction of a pixel, confirmed from the right picture back to the left. Exposures may differ.
std::vector<CornerMatch> match_corners(ImageView left, ImageView right, const CornerMatchOptions& options = {});

}  // namespace relmap::vision
