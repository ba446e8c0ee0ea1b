// Localises the camera against the last keyframe by its appearance set. It helps when the tracker no longer finds its
// landmarks (a gap of seconds, a sudden turn), since descriptors can be matched without a predicted position.
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

// The features of the keyframe that have a disparity of at least a pixel, as points. `pixel_sigma` is the standard
// deviation of a coordinate on level 0.
std::vector<DescribedPoint> described_points(const Keyframe& keyframe, double pixel_sigma);

struct Recognition {
  vision::Motion motion;  // T_keyframe_camera
  // Ok if the motion is reliable. Otherwise it is a hypothesis that patches must confirm: TOO_FEW_INLIERS (fewer than
  // 30 matches agree), POOR_SPREAD (they lie close together).
  Status doubt;
};

// Localises a rectified left picture; motions beyond `limits` are not considered. TOO_FEW_INLIERS if fewer than 12
// matches agree, or if they agree only in front of very uncertain points.
Result<Recognition> recognise(std::span<const DescribedPoint> points, vision::ImageView left,
                              const StereoCamera& camera, const std::optional<vision::MotionLimits>& limits,
                              std::uint64_t seed);

}  // namespace relmap::tracking
