// What a keyframe carries of its pictures: the appearance set and the left one itself.
#pragma once

#include <vector>

#include "frontend/tracking/pair.h"
#include "proto/keyframe/keyframe.h"

namespace relmap::tracking {

// The tracks of `keyframe` described, then detected keypoints, `max_features` in all, with disparities where the right
// picture has them, `offset` taken off (stereo_offset.h). `pair` is the keyframe's own. May run on any thread.
std::vector<AppearanceFeature> appearance_set(const Pair& pair, const Keyframe& keyframe, double offset,
                                              int max_features);

// Of the left eye's picture: nothing, enough to be looked at, or all, in which the map finds again what it knows
// (Keyframe::picture).
enum class KeyframePicture { kNone, kSmall, kWhole };
Bytes keyframe_picture(vision::ImageView picture, KeyframePicture kind);

}  // namespace relmap::tracking
