// Poses of a camera from three points and their rays.
#pragma once

#include <array>

#include "proto/geometry/geometry.h"

namespace relmap::vision {

// The poses T_camera_reference from which three points (in the reference's frame) are seen in front of the camera along
// the given rays (in the camera's frame, of any length): at most four, in no particular order. None if the points lie
// on a line or the rays coincide.
//
// The distances of the points from the camera satisfy three quadratic equations. Two combinations of these are conics
// through the solutions, and of the conics through both some are pairs of lines: these are found by a cubic equation,
// and cut with a conic (Persson and Nordberg, "Lambda Twist", ECCV 2018).
struct ThreePointPoses {
  std::array<SE3, 4> T_camera_reference;
  std::size_t count = 0;

  const SE3* begin() const { return T_camera_reference.data(); }
  const SE3* end() const { return begin() + count; }
};
ThreePointPoses three_point_poses(const std::array<Vector3, 3>& points, const std::array<Vector3, 3>& rays);

}  // namespace relmap::vision
