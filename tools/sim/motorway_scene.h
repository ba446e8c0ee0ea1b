// The motorway of a simulated world: little texture, most of it far away.
#pragma once

#include <cstdint>

#include "tools/sim/circuit.h"
#include "tools/sim/scene.h"

namespace relmap::sim {

// Metres to the right of the circuit, which is the middle of the middle lane. Traffic drives on the right.
inline constexpr double kLaneWidth = 3.75;
inline constexpr double kMedian = -8;  // the opposite carriageway is mirrored at this line

// Large curves only: no radius is below 100 m if the circuit is 650 m long or more.
Circuit motorway_circuit(std::uint64_t seed, double length_m);

// Two carriageways of three lanes, guard rails, noise barriers, verges, trees, hills, sky, some signs, gantries and
// bridges. The textures are shared, so that memory hardly grows with the length.
Scene build_motorway(const Circuit& circuit, std::uint64_t seed);

}  // namespace relmap::sim
