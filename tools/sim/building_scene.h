// The building of a simulated world: a corridor that goes round, on one floor or two, or winds up to where it began.
#pragma once

#include "tools/sim/picture_world_options.h"
#include "tools/sim/road.h"
#include "tools/sim/scene.h"

namespace relmap::sim {

inline constexpr double kCorridor = 1.35;  // metres from its middle to its walls

// Walls, doors, posters and things beside them. kLiftAlike: the second floor looks as the first does, kAlike: the
// second half as the first, but that about a quarter of what hangs and stands at the walls is another's.
Scene build_building(const PictureWorldOptions& options, const Road& road);

}  // namespace relmap::sim
