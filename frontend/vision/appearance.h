// The one detector and descriptor of the appearance set (METHOD 7): the same for training, maps and queries, because a
// vocabulary trained on one detector does not fit another's descriptors.
#pragma once

#include <span>
#include <vector>

#include "frontend/vision/image.h"
#include "proto/keyframe.h"

namespace relmap {

inline constexpr int kAppearanceFeatures = 300;

// The detector's keypoints, strongest first, spread over the picture, without disparity and track.
std::vector<AppearanceFeature> detect_appearance(ImageView grey, int max_features = kAppearanceFeatures);

// Descriptors at given positions and pyramid levels (tracked features). Order is kept; index i describes positions[i].
struct TrackedPosition {
  float u = 0, v = 0;
  int level = 0;
  std::int16_t track = -1;
};
std::vector<AppearanceFeature> describe_tracked(ImageView grey, std::span<const TrackedPosition> positions);

}  // namespace relmap
