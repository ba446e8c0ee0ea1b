// The appearance set of a picture that nobody tracks through: a training picture, or a question.
#pragma once

#include <vector>

#include "frontend/vision/image.h"
#include "proto/keyframe/keyframe.h"

namespace relmap::vision {

// Half of a keyframe's appearance set are its tracks: corners, described at their position and pyramid level. This
// describes the corners at which tracks would start, then the detector's keypoints, in the proportions of a keyframe,
// so that words mean the same in maps, vocabularies and questions. No disparities, no tracks. Deterministic.
std::vector<AppearanceFeature> picture_appearance(ImageView grey);

}  // namespace relmap::vision
