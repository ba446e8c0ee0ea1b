// Checks whether a picture was taken by the camera that is named for it: pose and lens are estimated together from
// points of known position, and the lens is compared with the named camera.
#pragma once

#include <span>

#include "frontend/vision/motion.h"
#include "proto/base/status.h"
#include "proto/geometry/camera.h"
#include "proto/geometry/geometry.h"

namespace relmap::vision {

// WRONG_CALIBRATION if the correspondences contradict `camera`; the message says what would fit, as in "a focal length
// 5 % longer". Ok if they agree, or cannot tell (few correspondences, a wall seen from the front). It detects a focal
// length that is more than about 4 % off, a principal point off by 1.5 to 2 % of the longer side, remaining distortion
// that moves the picture's corners by 6 % of their distance from the centre (a picture that was not rectified, or was
// rectified with another calibration), and a baseline that is 13 % off.
//
// `correspondences` must have been found without the camera, by appearance. `camera` is rectified and has a known f; a
// baseline of 0 means mono. `T_reference_camera` is the pose that was estimated with `camera`. `map_camera` is the
// stereo camera that saw the place.
Status check_camera(std::span<const Correspondence> correspondences, const StereoCamera& camera,
                    const SE3& T_reference_camera, const StereoCamera& map_camera, const MotionOptions& options = {});

}  // namespace relmap::vision
