// The right eye's view of a point of the left picture, along the row.
#pragma once

#include <optional>

#include "frontend/vision/pyramid.h"

namespace relmap::vision {

struct StereoMatchOptions {
  float min_disparity = 0;       // pixels of the picture
  float max_disparity = 256;     // pixels of the picture
  int rows = 1;                  // searched above and below, pixels of the level
  float uniqueness = 0.85F;      // best / second best that is no neighbour of it, of the sums of absolute differences
  float min_correlation = 0.8F;  // after the alignment
};

struct StereoMatch {
  float disparity = 0;    // u_left - u_right, pixels of the picture
  float correlation = 0;  // of the two patches
};

// (u, v) in pixels of the left picture, matched on `level`. Nothing where no match is unique, confirmed from the right
// picture back to the left, on the same row within a pixel of the level, and well correlated.
std::optional<StereoMatch> match_stereo(const Pyramid& left, const Pyramid& right, float u, float v, int level,
                                        const StereoMatchOptions& options = {});

// The same from a good guess: aligned within a few pixels of it, without a search.
std::optional<StereoMatch> refine_stereo(const Pyramid& left, const Pyramid& right, float u, float v, int level,
                                         float disparity, const StereoMatchOptions& options = {});

}  // namespace relmap::vision
