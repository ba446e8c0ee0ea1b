// What a keyframe carries of its pictures: the appearance set and a thumbnail.
#pragma once

#include <vector>

#include "frontend/tracking/matching.h"
#include "proto/keyframe.h"

namespace relmap {

// `tracks` (those of the keyframe) described, then detected keypoints, `max_features` in all, with disparities where
// the right picture has them.
std::vector<AppearanceFeature> appearance_set(ImageView left, const Pair& pair, const StereoCamera& camera,
                                              const std::vector<TrackMeasurement>& tracks, int max_features);

// A JPEG of at most kMaxThumbnailBytes and 160 pixels across; empty where that cannot be had.
Bytes make_thumbnail(ImageView picture);

}  // namespace relmap
