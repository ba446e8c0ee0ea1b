// The pose of a camera whose calibration is another's word: right within what calibrations are.
#pragma once

#include <span>

#include "frontend/vision/motion.h"
#include "proto/geometry/camera.h"
#include "proto/geometry/geometry.h"

namespace relmap::vision {

// From `start`, the pose that `camera` as it is named found (T_reference_camera, metres), pose and lens are refined
// together. The prior of the lens is the named one: its focal length within 1.5 %, its principal
// point within 0.5 % of the longer side, and a distortion that moves the picture's corners by 2 % of their distance
// from the centre (one standard deviation each). A focal length 2 % off moves the pose of a camera that is taken as
// exact by 2 % of the distance of what it sees, which no covariance of pixels knows of. Nor does it know of what all
// disparities of the map have wrong alike, which a free lens takes for its own: the covariance holds a pixel of that.
//
// Disparities of the camera are not used: they depend on its baseline, too. NO_CALIBRATION, TOO_FEW_INLIERS. `camera`:
// rectified. `map_camera`: that saw the place, with a baseline.
Result<Motion> estimate_tolerant_motion(std::span<const Correspondence> correspondences, const StereoCamera& camera,
                                        const StereoCamera& map_camera, const SE3& start,
                                        const MotionOptions& options = {});

}  // namespace relmap::vision
