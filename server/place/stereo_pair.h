// Checks that two pictures of a question were taken by the two eyes of one camera at one time.
#pragma once

#include "frontend/vision/image.h"
#include "proto/base/status.h"
#include "proto/geometry/camera.h"

namespace relmap::place {

// Refuses rectified pictures that cannot be a pair of `camera` taken at one time. Only clear cases are refused here;
// smaller errors are left to the verification of the place, and pictures that are too small to tell are accepted.
// EYE_DEAD (the left picture shows nothing), NOT_STEREO (both pictures are the same, or left and right are exchanged),
// ROWS_APART (what both pictures show lies more than two rows apart in them).
Status check_stereo_pair(vision::ImageView left, vision::ImageView right, const StereoCamera& camera);

}  // namespace relmap::place
