// How much of a picture a set of features covers.
#pragma once

#include <cstdint>
#include <span>

#include "proto/geometry/camera.h"
#include "proto/keyframe/keyframe.h"

namespace relmap::place {

// Share, 0..1, of the picture's 16 x 12 cells in which at least one of the features at `chosen` lies.
double picture_spread(std::span<const AppearanceFeature> features, std::span<const std::uint32_t> chosen,
                      const StereoCamera& camera);

}  // namespace relmap::place
