// What a keyframe carries of its pictures: the appearance set and a thumbnail.
#pragma once

#include <vector>

#include "frontend/tracking/pair.h"
#include "proto/keyframe.h"

namespace relmap {

// The tracks of `keyframe` described, then detected keypoints, `max_features` in all, with disparities where the right
// picture has them, `offset` taken off (stereo_offset.h). `pair` is the keyframe's own. May run on any thread.
std::vector<AppearanceFeature> appearance_set(const Pair& pair, const Keyframe& keyframe, double offset,
                                              int max_features);

// A JPEG of at most kMaxThumbnailBytes and 160 pixels across; empty where that cannot be had.
Bytes make_thumbnail(ImageView picture);

}  // namespace relmap
