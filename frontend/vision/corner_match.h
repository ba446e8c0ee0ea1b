// Corners that two pictures share, matched in both directions of the picture, without trust in a calibration.
#pragma once

#include <vector>

#include "frontend/vision/image.h"

namespace relmap::vision {

struct CornerMatchOptions {
  int wanted = 500;              // corners of the left picture to match
  float columns = 0.35F;         // search range to the left and to the right, as a share of the width
  float rows = 0.12F;            // search range above and below, as a share of the height
  float uniqueness = 0.8F;       // maximum of best / second best sum of absolute differences
  float min_correlation = 0.9F;  // of the patches after the alignment
};

// Positions in pixels.
struct CornerMatch {
  float u_left = 0, v_left = 0, u_right = 0, v_right = 0;
};

// Matches are aligned to a fraction of a pixel and confirmed from the right picture back to the left. Exposures may
// differ.
std::vector<CornerMatch> match_corners(ImageView left, ImageView right, const CornerMatchOptions& options = {});

}  // namespace relmap::vision
