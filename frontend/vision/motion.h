// The motion of a camera from points it knows and where it sees them now: three-point RANSAC, then a robust refinement
// on all inliers. Used by tracking (frame to frame) and by the server (a picture against a place).
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
  StereoPixel pixel;  // where the moved camera sees it; u_right NaN: mono
  double sigma = 1;   // pixels, of each coordinate of `pixel`
  // Covariance of `point` in the reference frame, or zero to take it as exact; widens the gate and the weights.
  Matrix3 point_covariance = Matrix3::Zero();
};

// What motions are possible at all: those within `metres` and `radians` of T_reference_camera.
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
  int max_trials = 400;      // fewer when the inlier ratio allows: bounded at 99.9 % confidence
  double gate_sigmas = 3.0;  // inlier: each coordinate within this many sigmas
  int min_inliers = 10;
  // A guess that this share agrees with is taken without trials: nothing that disagrees with it can gather more.
  double enough = 0.7;
  // The correspondences come likeliest first: samples are drawn from the first few, then from more and more (PROSAC;
  // Chum and Matas, CVPR 2005).
  bool ordered = false;
  // What many agree on may be a lorry that passes: without it, they would carry the camera along.
  std::optional<MotionLimits> limits;
};

struct Motion {
  SE3 T_reference_camera;              // pose of the moved camera in the reference frame
  Matrix6 covariance;                  // of T_reference_camera Exp(xi)
  std::vector<std::uint32_t> inliers;  // indices, ascending
  double rms_px = 0;                   // of the inliers, per coordinate
  // Mean square of the inliers' residuals over what their sigmas promise. Where it is above 1, `covariance` has it in.
  double variance_factor = 1;
};

// TOO_FEW_INLIERS (also with fewer than 3 correspondences, and where only motions beyond the limits explain them).
// `guess`, if given, is tried first.
Result<Motion> estimate_motion(std::span<const Correspondence> correspondences, const StereoCamera& camera,
                               const MotionOptions& options = {}, const SE3* guess = nullptr);

}  // namespace relmap::vision
