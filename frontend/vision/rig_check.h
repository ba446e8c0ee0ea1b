// Whether a stereo camera sees as its calibration says: measured on its rectified pictures, whatever they show.
#pragma once

#include <optional>
#include <vector>

#include "frontend/vision/corner_match.h"
#include "frontend/vision/exposure.h"
#include "frontend/vision/image.h"
#include "proto/status.h"

namespace relmap {

struct EyeReport {
  double mean = 0, deviation = 0;   // grey levels
  double saturated = 0, black = 0;  // shares of the pixels: 250 and above, 5 and below
  // Pixels, as edge_width(): of the sharper quarter of the pairs, since the others may have moved.
  std::optional<double> edge_width;
};

struct RigReport {
  int pairs = 0;
  int matches = 0;  // corners that both eyes see, of all pairs; what follows is of them, and 0 below 50
  // v_right - v_left, pixels: the median and the 90th percentile of its size, and its trend over the left picture.
  double row_error = 0, row_error_90 = 0;
  double row_offset = 0;                    // in the middle of the picture
  double row_slope_x = 0, row_slope_y = 0;  // from the left edge to the right one, and from the top to the bottom
  // u_left - u_right, pixels.
  double disparity = 0;           // median
  double positive_disparity = 0;  // share of those of more than a pixel to either side
  EyeReport left, right;
  std::vector<Status> findings;  // what is wrong, the cause before what follows from it; none: all is well
};

// Findings: EYE_DEAD (covered, constant, or the same at all times while the other changes), NOT_STEREO (both eyes show
// the same, or are exchanged), OUT_OF_FOCUS, TOO_FEW_FEATURES (nothing with texture, or not seen by both), ROWS_APART
// (more than a pixel: it is not this camera's calibration, or no longer).
class RigCheck {
 public:
  // BAD_SIZE: the eyes' pictures differ in size, or from those before, or have a side below 64 pixels. A dozen pairs of
  // a scene that moves are plenty.
  Status add(ImageView left, ImageView right);

  RigReport report() const;

 private:
  struct Eye {
    std::vector<Exposure> exposures;
    std::vector<double> edge_widths;
    double saturated = 0, black = 0;  // sums of shares
    int blind = 0, repeated = 0;      // pairs
    Image last;
    void add(ImageView picture);
    EyeReport report() const;
  };
  Eye left_, right_;
  int pairs_ = 0, same_ = 0;
  std::vector<CornerMatch> matches_;
};

}  // namespace relmap
