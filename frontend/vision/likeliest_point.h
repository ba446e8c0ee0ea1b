// Where the points of correspondences most likely are, given the pose of the camera. Internal to frontend/vision.
//
// The depth of a point that was measured by its disparity has no Gaussian error if the disparity is small. Of two
// points at the same distance the one that was measured too near also has the smaller covariance and so the larger
// weight, which draws the pose: cameras 3 to 12 m apart, with points 6 to 60 m before them and a baseline of 0.4 m,
// come out 0.05 to 0.4 m too near to each other. The *inverse* distance does have a Gaussian error (Civera, Davison and
// Montiel, IEEE T-RO 2008), and the second view measures it, too. So the point is estimated again from both views, and
// its covariance is that at the estimate.
#pragma once

#include "frontend/vision/motion.h"

namespace relmap::vision {

// Whether the distance of the point is known so well that its error may be taken for Gaussian, too.
bool is_well_known(const Correspondence& c);

// Returns `c` with its point where it most likely is if the camera stands at `T_camera_reference`, and with the
// covariance that the point has there. The pixel is changed by what the move shows to first order, so the difference
// from the new point's projection is still that between two independent measurements. A point behind the camera is
// returned as it is.
Correspondence at_likeliest_point(const Correspondence& c, const StereoCamera& camera, const SE3& T_camera_reference);

}  // namespace relmap::vision
