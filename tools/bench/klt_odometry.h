// The reference for the front-end: stereo odometry put together from OpenCV's parts, as tutorials do it.
#pragma once

#include <memory>

#include "frontend/vision/image.h"
#include "proto/geometry/camera.h"
#include "proto/geometry/geometry.h"

namespace relmap::bench {

// goodFeaturesToTrack where features have become few; pyramidal Lucas-Kanade from left to right gives them depth, and
// from picture to picture tells where they went; solvePnPRansac with refinement gives the motion. One thread.
class KltOdometry {
 public:
  KltOdometry(const StereoCamera& camera, int features);
  ~KltOdometry();

  // Rectified pictures. Returns the pose in the first pair's frame; where the motion cannot be had, the last step is
  // repeated.
  SE3 feed(vision::ImageView left, vision::ImageView right);
  int tracked() const;  // features that agreed with the last motion

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace relmap::bench
