// The points that the tracker follows. They lie near the robot, in the frame of its last keyframe, and are forgotten
// once the robot has passed them.
#pragma once

#include <optional>

#include "frontend/vision/template.h"
#include "proto/base/ids.h"
#include "proto/geometry/camera.h"
#include "proto/geometry/geometry.h"

namespace relmap::tracking {

struct Landmark {
  std::optional<TrackId> track;  // set at its first keyframe
  Vector3 point;                 // in the last keyframe's frame
  Matrix3 covariance;            // of `point`
  int level = 0;                 // pyramid level of its patch

  vision::Anchor anchor;      // its appearance
  double anchor_depth = 0;    // its depth when the anchor was taken, metres
  Matrix3 R_anchor_keyframe;  // rotation from the last keyframe to the camera that took the anchor

  int age = 0;     // keyframes since it started
  int missed = 0;  // consecutive pairs in which it was not found or disagreed

  // The warp of its patch for a camera at `T_camera_keyframe`, assuming that the surface faces the camera.
  vision::Warp warp(const SE3& T_camera_keyframe) const;
  // Takes a new anchor at (x, y) of its pyramid level, from a camera at `T_camera_keyframe`. The anchor stays unchanged
  // if the position is too close to the border.
  void take_anchor(vision::ImageView level_image, float x, float y, const SE3& T_camera_keyframe);
};

// A landmark's position in stereo pixels. Its error is nearly Gaussian in (u_left, v, u_right), and not in metres, so
// measurements are combined there.
struct StereoEstimate {
  StereoPixel pixel;
  Matrix3 covariance;
};
StereoEstimate to_pixels(const StereoCamera& camera, const Vector3& point, const Matrix3& covariance);
// The disparity (pixel.x - pixel.z) must be positive.
void from_pixels(const StereoCamera& camera, const StereoEstimate& estimate, Vector3& point, Matrix3& covariance);

// Updates a landmark with a measurement (mono or stereo) that was made at the frame in which `point` is given, with a
// standard deviation of `sigma` pixels in each coordinate. Returns false, and changes nothing, if the result would have
// no positive disparity.
bool join_measurement(const StereoCamera& camera, const StereoPixel& pixel, double sigma, Vector3& point,
                      Matrix3& covariance);

}  // namespace relmap::tracking
