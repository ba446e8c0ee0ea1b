// FAST corners on each level of a pyramid (Rosten and Drummond, ECCV 2006), scored by Harris and Stephens (1988).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "frontend/vision/pyramid.h"

namespace relmap::vision {

struct Corner {
  std::int16_t x = 0, y = 0;  // pixels of the level
  float score = 0;            // Harris: det - 0.04 trace^2 of the gradients' second moments over 7 x 7 pixels
};

struct CornerOptions {
  int wanted = 1000;         // on level 0; half as many on each level above
  int lowest_threshold = 5;  // grey levels
  int highest_threshold = 80;
  int border = 8;  // pixels of the level kept free of corners
};

// The threshold of each level is steered toward the wanted number of corners from picture to picture, so the same
// pictures in the same order give the same corners.
class CornerDetector {
 public:
  explicit CornerDetector(const CornerOptions& options = {});

  // Corners of each level, by row and then column. Those whose Harris score is not positive (edges) are left out.
  std::vector<std::vector<Corner>> detect(const Pyramid& pyramid);

  int threshold(int level) const { return thresholds_[static_cast<std::size_t>(level)]; }

 private:
  CornerOptions options_;
  std::array<int, 8> thresholds_;
};

float harris_score(ImageView image, int x, int y);  // needs 4 pixels on every side

}  // namespace relmap::vision
