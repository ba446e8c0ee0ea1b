// The points that the tracker follows: near the robot, in the frame of its last keyframe, and forgotten behind it.
#pragma once

#include <optional>

#include "frontend/vision/template.h"
#include "proto/base/ids.h"
#include "proto/geometry/camera.h"
#include "proto/geometry/geometry.h"

namespace relmap::tracking {

struct Landmark {
  std::optional<TrackId> track;  // from its first keyframe on
  Vector3 point;                 // in the last keyframe's frame
  Matrix3 covariance;            // of `point`
  int level = 0;                 // pyramid level of its patch

  vision::Anchor anchor;      // how it looked
  double anchor_depth = 0;    // metres, when the anchor was taken
  Matrix3 R_anchor_keyframe;  // orientation of the camera then, from the last keyframe

  int age = 0;     // keyframes since it started
  int missed = 0;  // pairs in a row in which it was not found or disagreed

  // How the patch looks to a camera at `T_camera_keyframe`, the surface taken as facing the camera.
  vision::Warp warp(const SE3& T_camera_keyframe) const;
  // Takes a new anchor at (u, v) of a picture taken at `T_camera_keyframe`; unchanged if that is too near the border.
  void take_anchor(vision::ImageView level_image, float x, float y, const SE3& T_camera_keyframe);
};

// A landmark's position is Gaussian in (u_left, v, u_right), nearly, and not in metres; so that is where measurements
// are joined.
struct StereoEstimate {
  StereoPixel pixel;
  Matrix3 covariance;
};
StereoEstimate to_pixels(const StereoCamera& camera, const Vector3& point, const Matrix3& covariance);
// Needs pixel.x > pixel.z.
void from_pixels(const StereoCamera& camera, const StereoEstimate& estimate, Vector3& point, Matrix3& covariance);

// Joins a measurement (mono or stereo) made with `sigma` pixels in each coordinate at the frame that `point` is in.
// False, and nothing changes, where the result would lie behind the camera.
bool join_measurement(const StereoCamera& camera, const StereoPixel& pixel, double sigma, Vector3& point,
                      Matrix3& covariance);

}  // namespace relmap::tracking
