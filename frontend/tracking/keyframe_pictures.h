// What a keyframe carries of its pictures: the appearance set and the left picture itself.
#pragma once

#include <vector>

#include "frontend/tracking/pair.h"
#include "proto/keyframe/keyframe.h"

namespace relmap::tracking {

// Describes the tracks of `keyframe` and then detected keypoints, `max_features` in all. Features that the right
// picture shows get a disparity, less `offset` pixels (stereo_offset.h). `pair` is the keyframe's own. Thread-safe.
std::vector<AppearanceFeature> appearance_set(const Pair& pair, const Keyframe& keyframe, double offset,
                                              int max_features);

// The left picture that a keyframe carries (Keyframe::picture): none, a thumbnail, or the whole, in which the map can
// find its landmarks again.
enum class KeyframePicture { kNone, kSmall, kWhole };
Bytes keyframe_picture(vision::ImageView picture, KeyframePicture kind);

}  // namespace relmap::tracking
