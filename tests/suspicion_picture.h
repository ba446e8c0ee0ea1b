// The picture of docs/evidence.md that shows how the suspicion of a closure follows from its facts.
#pragma once

#include <string>

namespace relmap::testing {

// SVG: for each doubt its weight, as server/map/suspicion.h has it, over the fact from which it follows.
std::string suspicion_picture();

}  // namespace relmap::testing
