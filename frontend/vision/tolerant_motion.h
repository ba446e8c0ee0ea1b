// The pose of a camera whose calibration comes from outside and has the errors that calibrations usually have.
#pragma once

#include <span>

#include "frontend/vision/motion.h"
#include "proto/geometry/camera.h"
#include "proto/geometry/geometry.h"

namespace relmap::vision {

// Refines pose and lens together, from `start`: the pose that was estimated with `camera` taken as exact
// (T_reference_camera, metres). `camera` is rectified; `map_camera` is the stereo camera that saw the place.
// Disparities of the camera are not used, since they depend on its baseline, too. NO_CALIBRATION, TOO_FEW_INLIERS.
//
// The prior of the lens is `camera`, with standard deviations of 1.5 % of the focal length, 0.5 % of the longer side
// for the principal point, and a distortion that moves the picture's corners by 2 % of their distance from the centre.
// If a camera is taken as exact, a focal length that is 2 % off moves its pose by 2 % of the distance to what it sees,
// and a covariance from pixel noise does not contain that error. Nor does it contain the error that all disparities of
// the map have in common, which a free lens would absorb; the covariance returned allows for one pixel of it.
Result<Motion> estimate_tolerant_motion(std::span<const Correspondence> correspondences, const StereoCamera& camera,
                                        const StereoCamera& map_camera, const SE3& start,
                                        const MotionOptions& options = {});

}  // namespace relmap::vision
