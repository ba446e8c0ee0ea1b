// Measures how much of a picture a set of features covers.
#pragma once

#include <cstdint>
#include <span>

#include "proto/geometry/camera.h"
#include "proto/keyframe/keyframe.h"

namespace relmap::place {

// The share (0..1) of the picture's 16 x 12 cells that hold at least one of the features whose indices are in `chosen`.
double picture_spread(std::span<const AppearanceFeature> features, std::span<const std::uint32_t> chosen,
                      const StereoCamera& camera);

}  // namespace relmap::place
