// How well the points of a layout are known relative to one frame.
#pragma once

#include <vector>

#include "proto/base/status.h"
#include "tools/console/layout/map_layout.h"

namespace relmap::console {

// For each point the standard deviation of its position relative to the root, metres (client/path_uncertainty.h);
// infinite where steps that nothing measured lie between, or nothing at all. A root between two points stands for the
// nearer one. NO_SUCH_FRAME: the layout does not have the root.
Result<std::vector<float>> root_sigmas(const MapLayout& layout, FrameId root);

}  // namespace relmap::console
