// The street of a simulated world.
#pragma once

#include <cstdint>

#include "tools/sim/circuit.h"
#include "tools/sim/scene.h"

namespace relmap::sim {

// Closed rows of houses on both sides of the circuit, ground, sky, and things on the pavements. The road is free within
// 1 m of its middle.
Scene build_street(const Circuit& circuit, std::uint64_t seed);

}  // namespace relmap::sim
