// The rotation between two pictures of one camera from small versions of them, before any feature is matched: efficient
// second-order minimisation over SO(3) (ESM; Malis, ICRA 2004; Mei et al., BMVC 2009, 3.1). What is near moves with the
// camera's translation too, so the answer is a prediction, not a measurement; how much it may be trusted comes with it.
#pragma once

#include <optional>

#include "frontend/vision/pyramid.h"
#include "proto/geometry/camera.h"
#include "proto/geometry/geometry.h"

namespace relmap::vision {

struct RotationEstimate {
  Matrix3 R_reference_current = Matrix3::Identity();
  double correlation = 0;  // of the pictures where they overlap, -1..1: below about 0.6 they show different things
  double sigma = 0;        // radians, of each axis: what the residuals leave open were there no translation
};

// Where `expected` does not lead to a likeness, the best shift of the coarsest level is searched, over 0.4 of the
// picture's width and 0.3 of its height either way. Nothing if the pictures have no texture or overlap by less than a
// quarter.
std::optional<RotationEstimate> align_rotation(const Pyramid& reference, const Pyramid& current,
                                               const StereoCamera& camera,
                                               const Matrix3& expected = Matrix3::Identity());

}  // namespace relmap::vision
