// The pose of a camera from 3D-2D correspondences: three-point RANSAC, then a robust refinement over all inliers. Used
// by tracking (frame to frame) and by the server (a picture against a place).
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "proto/base/status.h"
#include "proto/geometry/camera.h"
#include "proto/geometry/geometry.h"

namespace relmap::vision {

struct Correspondence {
  Vector3 point;      // in the reference frame, metres
  StereoPixel pixel;  // where the moved camera sees it; u_right is NaN for mono
  double sigma = 1;   // of each coordinate of `pixel`, in pixels
  // Covariance of `point` in the reference frame; zero if the point is exact. It widens the gate and lowers the weight.
  Matrix3 point_covariance = Matrix3::Zero();
  // The eye that measured the point, in the reference frame: along the ray from there the inverse distance has a
  // Gaussian error (likeliest_point.h).
  Vector3 seen_from = Vector3::Zero();
};

// Limits the motion to poses within `metres` and `radians` of T_reference_camera.
struct MotionLimits {
  SE3 T_reference_camera;
  double metres = 0, radians = 0;

  bool allow(const SE3& T) const {
    const SE3 difference = T_reference_camera.inverse() * T;
    return difference.t.norm() <= metres && rotation_angle(difference.R) <= radians;
  }
};

struct MotionOptions {
  std::uint64_t seed = 1;    // the same seed and input give the same answer
  int max_trials = 400;      // fewer are drawn once the inlier ratio gives 99.9 % confidence
  double gate_sigmas = 3.0;  // each coordinate of an inlier is within this many sigmas of its prediction
  int min_inliers = 10;
  // A guess with at least this share of inliers is accepted without trials: no pose that contradicts it can have more.
  // Uncertain correspondences count for less in the share.
  double enough = 0.7;
  // The correspondences are ordered, likeliest first. Samples are drawn from the first few, then from more and more
  // (PROSAC; Chum and Matas, CVPR 2005).
  bool ordered = false;
  // Without limits, a vehicle that passes and fills the picture would be taken for a motion of the camera.
  std::optional<MotionLimits> limits;
  // At the end, uncertain points are moved to where they most likely are by both views (likeliest_point.h), and the
  // pose is refined with them. Which ones are inliers is not decided again. Only estimate_motion() does so.
  bool correct_points = false;
};

struct Motion {
  SE3 T_reference_camera;              // pose of the moved camera in the reference frame
  Matrix6 covariance;                  // of xi in T_reference_camera Exp(xi)
  std::vector<std::uint32_t> inliers;  // indices, ascending
  double rms_px = 0;                   // reprojection error of the inliers, per coordinate
  // Variance of unit weight of the inliers' residuals: about 1 if they are as large as their sigmas say. If it is above
  // 1, `covariance` has been multiplied by it.
  double variance_factor = 1;
};

// Estimates the pose of `camera`. `guess`, if given, is tried first. TOO_FEW_INLIERS, also with fewer than 3
// correspondences, and if only motions beyond the limits explain them.
Result<Motion> estimate_motion(std::span<const Correspondence> correspondences, const StereoCamera& camera,
                               const MotionOptions& options = {}, const SE3* guess = nullptr);

}  // namespace relmap::vision
