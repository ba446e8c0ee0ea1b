// Detector and descriptor of the appearance set (docs/method.md, 7). Training, maps and queries share them, because a
// vocabulary trained on one detector does not fit another's descriptors.
//
// The detector is SIFT (Lowe 2004; OpenCV's, 3 layers an octave, contrast 0.02 / 3, edge 10, sigma 1.6). Its first
// octave is the picture itself, or the doubled picture if that gives fewer keypoints than asked for. Of a keypoint with
// several orientations one is kept. To spread keypoints, the picture is divided into cells; each cell contributes its
// strongest keypoint, then its second strongest, and so on. The same picture gives the same answer, bit for bit.
#pragma once

#include <span>
#include <vector>

#include "frontend/vision/image.h"
#include "proto/keyframe/keyframe.h"

namespace relmap::vision {

inline constexpr int kAppearanceFeatures = 300;

// Returns the detector's keypoints, strongest first, spread over the picture, without disparity and track. Pixel (0, 0)
// is the centre of the top left pixel. Empty for a picture with a side below 16 pixels.
std::vector<AppearanceFeature> detect_appearance(ImageView grey, int max_features = kAppearanceFeatures);

// A tracked feature: pixel of the picture, pyramid level, and track.
struct TrackedPosition {
  float u = 0, v = 0;
  int level = 0;
  std::int16_t track = -1;
};
// Describes `positions`, in their order: element i describes positions[i]. The region described is that of a SIFT
// keypoint of sigma 2.5 x 2^level, turned to its strongest gradient.
std::vector<AppearanceFeature> describe_tracked(ImageView grey, std::span<const TrackedPosition> positions);

// Returns the whole set of a keyframe in one pass: the tracked positions first, in order, then detected keypoints that
// do not coincide with them; `max_features` in all, but never fewer than the tracked ones.
std::vector<AppearanceFeature> detect_appearance(ImageView grey, std::span<const TrackedPosition> tracked,
                                                 int max_features = kAppearanceFeatures);

}  // namespace relmap::vision
