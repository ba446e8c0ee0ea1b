// Where the tracker finds its landmarks no more (a gap of seconds, a sudden turn), the last keyframe's appearance set
// may still tell where the camera is: descriptors do not need to know where to look.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "frontend/vision/image.h"
#include "frontend/vision/motion.h"
#include "proto/keyframe/keyframe.h"

namespace relmap::tracking {

struct DescribedPoint {
  Vector3 point;  // in the keyframe's frame
  Matrix3 covariance;
  std::array<std::uint8_t, 128> descriptor;
};

// The features of the keyframe that have a depth.
std::vector<DescribedPoint> described_points(const Keyframe& keyframe, double pixel_sigma);

struct Recognition {
  vision::Motion motion;  // T_keyframe_camera
  // OK: it can be believed as it is. Else it is a hypothesis for patches to confirm: TOO_FEW_INLIERS (fewer than 30
  // matches agree), POOR_SPREAD (they lie close together).
  Status doubt;
};

// Of a rectified left picture. TOO_FEW_INLIERS: fewer than 12 matches agree. `limits`: what motions are possible.
Result<Recognition> recognise(std::span<const DescribedPoint> points, vision::ImageView left,
                              const StereoCamera& camera, const std::optional<vision::MotionLimits>& limits,
                              std::uint64_t seed);

}  // namespace relmap::tracking
