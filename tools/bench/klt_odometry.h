// The reference for the front-end: stereo odometry made of OpenCV's functions, as in tutorials.
#pragma once

#include <memory>

#include "frontend/vision/image.h"
#include "proto/geometry/camera.h"
#include "proto/geometry/geometry.h"

namespace relmap::bench {

// goodFeaturesToTrack finds features when they become few; pyramidal Lucas-Kanade from left to right gives their depth,
// and from picture to picture their tracks; solvePnPRansac with refinement gives the motion. One thread.
class KltOdometry {
 public:
  KltOdometry(const StereoCamera& camera, int features);
  ~KltOdometry();

  // Takes a rectified pair, and returns its pose in the frame of the first pair. If the motion cannot be computed, the
  // last step is repeated.
  SE3 feed(vision::ImageView left, vision::ImageView right);
  int tracked() const;  // features that agreed with the last motion

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace relmap::bench
