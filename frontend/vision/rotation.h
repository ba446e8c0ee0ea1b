// The rotation between two pictures of one camera, estimated from small versions of them before any feature is matched:
// efficient second-order minimisation over SO(3) (ESM; Malis, ICRA 2004; Mei et al., BMVC 2009, 3.1). Near things also
// move with the camera's translation, so the result is a prediction and not a measurement. `correlation` and `sigma`
// say how far to trust it.
#pragma once

#include <optional>

#include "frontend/vision/pyramid.h"
#include "proto/geometry/camera.h"
#include "proto/geometry/geometry.h"

namespace relmap::vision {

struct RotationEstimate {
  Matrix3 R_reference_current = Matrix3::Identity();
  double correlation = 0;  // of the pictures where they overlap, -1..1; below about 0.6 they show different things
  double sigma = 0;        // standard deviation about each axis in radians, assuming that there is no translation
};

// Starts from `expected` (R_reference_current). If the pictures do not correlate there, it searches the best shift on
// the coarsest level, over 0.4 of the picture's width and 0.3 of its height either way. Nothing if the pictures have no
// texture or overlap by less than a quarter.
std::optional<RotationEstimate> align_rotation(const Pyramid& reference, const Pyramid& current,
                                               const StereoCamera& camera,
                                               const Matrix3& expected = Matrix3::Identity());

}  // namespace relmap::vision
