// The appearance set of a single picture, one without tracks: a training picture or a query.
#pragma once

#include <vector>

#include "frontend/vision/image.h"
#include "proto/keyframe/keyframe.h"

namespace relmap::vision {

// Half of a keyframe's appearance set are its tracks: corners, described at their position and pyramid level. This
// function describes the corners at which tracks would start, then the detector's keypoints, in the proportions of a
// keyframe, so that words mean the same in maps, vocabularies and queries. The features have no disparity and no track.
// Deterministic.
std::vector<AppearanceFeature> picture_appearance(ImageView grey);

}  // namespace relmap::vision
