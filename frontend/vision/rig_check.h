// Checks whether a stereo camera agrees with its calibration. It measures rectified pictures of any scene.
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
  double saturated = 0, black = 0;  // share of the pixels with a grey level of 250 and above, of 5 and below
  // edge_width() in pixels: the lower quartile over the pairs, since motion may have blurred the others.
  std::optional<double> edge_width;
};

struct RigReport {
  int pairs = 0;
  int matches = 0;  // corners that both eyes see, over all pairs; the row and disparity values below are 0 if under 50
  // Row errors v_right - v_left in pixels: the median and the 90th percentile of their absolute values, and their trend
  // over the left picture.
  double row_error = 0, row_error_90 = 0;
  double row_offset = 0;                    // in the middle of the picture
  double row_slope_x = 0, row_slope_y = 0;  // change from the left edge to the right, and from the top to the bottom
  // Disparities u_left - u_right in pixels.
  double disparity = 0;           // median
  double positive_disparity = 0;  // share of positive ones among those whose absolute value is above 1
  double negative_disparity = 0;  // share of those below -1 among all
  // The yaw of the right eye against the calibration, in degrees. It is positive towards the left eye, which makes
  // disparities too small. Nothing if it cannot be determined or the camera is not known. `yaw_by_rows` comes from row
  // errors that grow towards two opposite corners of the picture. Other errors of a calibration look similar: 0.6
  // degrees were measured on good cameras.
  std::optional<double> yaw_by_rows;
  std::optional<double> yaw_by_motion;  // from the disparity of points at infinity (disparity_zero.h)
  int motions = 0;                      // motions that measured it
  EyeReport left, right;
  std::vector<Status> findings;  // what is wrong, causes before their consequences; empty if all is well
  // At least one finding is a fault of the camera or its calibration and not of the scene: its depths are not usable.
  bool wrong = false;
  // The first finding of that kind; ok if there is none.
  Status what_is_wrong() const;
};

// Collects pairs and reports on them. Findings: EYE_DEAD (an eye is covered or constant, or repeats one picture while
// the other changes), NOT_STEREO (both eyes show the same, or are exchanged, or one has a yaw against the calibration),
// OUT_OF_FOCUS, TOO_FEW_FEATURES (no texture, or none that both eyes see), ROWS_APART (by more than a pixel: the
// calibration is another camera's, or outdated).
class RigCheck {
 public:
  // `camera` is that of the rectified pictures. Without it no angles are reported.
  explicit RigCheck(const std::optional<StereoCamera>& camera = {}) : camera_(camera) {}

  // Adds a rectified pair. `later` is what the left eye saw about a tenth of a second after it; empty if it is not
  // known. A dozen pairs of a scene that moves are plenty. BAD_SIZE if the two pictures differ in size from each other
  // or from those before, or have a side below 64 pixels.
  Status add(ImageView left, ImageView right, ImageView later = {});

  int matches() const { return static_cast<int>(matches_.size()); }  // so far, mismatches included
  int motions() const { return static_cast<int>(zeros_.size()); }    // so far, of those that measured the yaw

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
  std::vector<double> zeros_;  // disparity of points at infinity in pixels, one per motion
  int pairs_ = 0, same_ = 0;
  std::vector<CornerMatch> matches_;
};

// What to do about a finding, as in "calibrate anew"; empty if there is no advice.
std::string rig_advice(Reason finding);
// The finding with "; what helps: calibrate anew, ..." appended to its message.
Status with_advice(const Status& finding);

}  // namespace relmap::vision
