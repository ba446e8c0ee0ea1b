// The one detector and descriptor of the appearance set (docs/method.md, 7): the same for training, maps and queries,
// because a vocabulary trained on one detector does not fit another's descriptors.
//
// Detector: SIFT (Lowe 2004; OpenCV's, 3 layers an octave, contrast 0.02 / 3, edge 10, sigma 1.6) whose first octave
// is the picture itself; where that gives fewer keypoints than asked for, the doubled picture. Of a keypoint with
// several orientations one is kept. Spread: the picture is cut into cells, each gives its strongest, then its second
// strongest, and so on. The same picture gives the same answer, bit for bit.
#pragma once

#include <span>
#include <vector>

#include "frontend/vision/image.h"
#include "proto/keyframe/keyframe.h"

namespace relmap::vision {

inline constexpr int kAppearanceFeatures = 300;

// The detector's keypoints, strongest first, spread over the picture, without disparity and track. Pixel (0, 0) is the
// centre of the top left pixel. Empty for a picture with a side below 16 pixels.
std::vector<AppearanceFeature> detect_appearance(ImageView grey, int max_features = kAppearanceFeatures);

// Descriptors at given positions and pyramid levels (tracked features). Order is kept; index i describes positions[i].
// The region described is that of a SIFT keypoint of sigma 2.5 x 2^level, turned to its strongest gradient.
struct TrackedPosition {
  float u = 0, v = 0;
  int level = 0;
  std::int16_t track = -1;
};
std::vector<AppearanceFeature> describe_tracked(ImageView grey, std::span<const TrackedPosition> positions);

// The whole set of a keyframe at the price of one: the tracked positions first, in order, then detected keypoints that
// describe something else, `max_features` together (but never fewer than the tracked ones).
std::vector<AppearanceFeature> detect_appearance(ImageView grey, std::span<const TrackedPosition> tracked,
                                                 int max_features = kAppearanceFeatures);

}  // namespace relmap::vision
