// FAST corners on each level of a pyramid (Rosten and Drummond, ECCV 2006), scored by Harris and Stephens (1988).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "frontend/vision/pyramid.h"

namespace relmap::vision {

struct Corner {
  std::int16_t x = 0, y = 0;  // pixels of the level
  float score = 0;            // Harris: det - 0.04 trace^2 of the second-moment matrix over 7 x 7 pixels
};

struct CornerOptions {
  int wanted = 1000;      // on level 0; half as many on each level above
  int min_threshold = 5;  // grey levels
  int max_threshold = 80;
  int border = 8;  // pixels of the level kept free of corners
};

// The detector adapts the threshold of each level from picture to picture, toward the wanted number of corners. The
// result therefore depends on the pictures before: the same pictures in the same order give the same corners.
class CornerDetector {
 public:
  explicit CornerDetector(const CornerOptions& options = {});

  // Returns the corners of each level, sorted by row and then column. Corners whose Harris score is not positive
  // (edges) are left out.
  std::vector<std::vector<Corner>> detect(const Pyramid& pyramid);

  int threshold(int level) const { return thresholds_[static_cast<std::size_t>(level)]; }

 private:
  CornerOptions options_;
  std::array<int, 8> thresholds_;
};

float harris_score(ImageView image, int x, int y);  // needs 4 pixels on every side

}  // namespace relmap::vision
