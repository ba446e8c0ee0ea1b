// Finds a point of the left picture in the right one, along the row.
#pragma once

#include <optional>

#include "frontend/vision/pyramid.h"

namespace relmap::vision {

struct StereoMatchOptions {
  float min_disparity = 0;       // pixels of the picture
  float max_disparity = 256;     // pixels of the picture
  int rows = 1;                  // search range above and below, pixels of the level
  float uniqueness = 0.85F;      // maximum of best / second best sum of absolute differences, neighbours excluded
  float min_correlation = 0.8F;  // of the patches after the alignment
};

struct StereoMatch {
  float disparity = 0;    // u_left - u_right, pixels of the picture
  float correlation = 0;  // of the two patches
};

// Matches the point at (u, v), in pixels of the left picture, on `level`. Nothing unless the match is unique, confirmed
// from the right picture back to the left, on the same row within a pixel of the level, and well correlated.
std::optional<StereoMatch> match_stereo(const Pyramid& left, const Pyramid& right, float u, float v, int level,
                                        const StereoMatchOptions& options = {});

// The same from a good guess of the disparity: only a few pixels around it are searched, and neither uniqueness nor the
// way back is checked.
std::optional<StereoMatch> refine_stereo(const Pyramid& left, const Pyramid& right, float u, float v, int level,
                                         float disparity, const StereoMatchOptions& options = {});

}  // namespace relmap::vision
