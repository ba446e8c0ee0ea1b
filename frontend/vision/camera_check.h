// Whether a picture was taken by the camera that is named for it. What it shows of a place whose shape is known tells:
// pose and lens are estimated together, and the lens is compared.
#pragma once

#include <span>

#include "frontend/vision/motion.h"
#include "proto/base/status.h"
#include "proto/geometry/camera.h"
#include "proto/geometry/geometry.h"

namespace relmap::vision {

// Of correspondences that were found without the camera (by what they look like), and the pose that was found with it.
// WRONG_CALIBRATION, whose message is what would fit: "a focal length 5 % longer". Found are a focal length more than
// about 4 % off, a principal point 1.5 to 2 % of the longer side off, a distortion that is left in and moves the
// picture's corners by 6 % of their distance from the centre (a picture that was not rectified, or was with another
// calibration), a baseline 13 % off. Ok: all is well, or what is seen does not tell (few correspondences, a wall seen
// from the front). `camera`: rectified, f known; baseline 0: mono. `map_camera`: that saw the place, with a baseline.
Status check_camera(std::span<const Correspondence> correspondences, const StereoCamera& camera,
                    const SE3& T_reference_camera, const StereoCamera& map_camera, const MotionOptions& options = {});

}  // namespace relmap::vision
