// The building of a simulated world: a closed corridor on one floor or two, or with a ramp that winds once round.
#pragma once

#include "tools/sim/picture_world_options.h"
#include "tools/sim/road.h"
#include "tools/sim/scene.h"

namespace relmap::sim {

inline constexpr double kCorridor = 1.35;  // metres from its middle to its walls

// Walls, doors, posters and things beside them. With kLiftAlike the second floor looks like the first, with kAlike the
// second half of the corridor like the first half, except for about a quarter of the things at the walls.
Scene build_building(const PictureWorldOptions& options, const Road& road);

}  // namespace relmap::sim
