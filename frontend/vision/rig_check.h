// Whether a stereo camera sees as its calibration says: measured on its rectified pictures, whatever they show.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "frontend/vision/corner_match.h"
#include "frontend/vision/disparity_zero.h"
#include "frontend/vision/exposure.h"
#include "frontend/vision/image.h"
#include "proto/base/status.h"
#include "proto/geometry/camera.h"

namespace relmap::vision {

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
  double negative_disparity = 0;  // share of all that are below -1
  // How far the right eye is turned about its vertical axis against the calibration, degrees; positive: towards the
  // left one, which makes disparities too small. Nothing: it cannot be told, or the camera is not known. By rows: they
  // spread towards two opposite corners of the picture. Other errors of a calibration look like it: 0.6 degrees were
  // measured on good cameras.
  std::optional<double> yaw_by_rows;
  std::optional<double> yaw_by_motion;  // by the disparity that far things have: disparity_zero.h
  int motions = 0;                      // that told it
  EyeReport left, right;
  std::vector<Status> findings;  // what is wrong, the cause before what follows from it; none: all is well
  // One of them is no matter of what stands before the camera: no metres are to be had of it.
  bool wrong = false;
  // That one, the first of several; ok: none.
  Status what_is_wrong() const;
};

// Findings: EYE_DEAD (covered, constant, or the same at all times while the other changes), NOT_STEREO (both eyes show
// the same, or are exchanged, or one is turned to the side against the calibration), OUT_OF_FOCUS, TOO_FEW_FEATURES
// (nothing with texture, or not seen by both), ROWS_APART (more than a pixel: it is not this camera's calibration, or
// no longer).
class RigCheck {
 public:
  // `camera`: of the rectified pictures. Without one nothing is said of angles.
  explicit RigCheck(const std::optional<StereoCamera>& camera = {}) : camera_(camera) {}

  // BAD_SIZE: the eyes' pictures differ in size, or from those before, or have a side below 64 pixels. A dozen pairs of
  // a scene that moves are plenty.
  // `later`: what the left eye saw a tenth of a second or so after; empty: it is not known.
  Status add(ImageView left, ImageView right, ImageView later = {});

  int matches() const { return static_cast<int>(matches_.size()); }  // so far, chance likenesses among them
  int motions() const { return static_cast<int>(zeros_.size()); }    // so far, that tell the yaw

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
  void add_motion(const std::vector<CornerMatch>& matches, ImageView left, ImageView later);

  std::optional<StereoCamera> camera_;
  Eye left_, right_;
  std::vector<double> zeros_;  // pixels, one a motion
  int pairs_ = 0, same_ = 0;
  std::vector<CornerMatch> matches_;
};

// What to do about a finding: "calibrate anew". Empty: nothing is known that helps.
std::string rig_advice(Reason finding);
// The finding, whose message goes on with "; what helps: calibrate anew, ...".
Status with_advice(const Status& finding);

}  // namespace relmap::vision
