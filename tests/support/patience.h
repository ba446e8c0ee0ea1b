// How long tests wait for what a working program does soon.
#pragma once

#include <chrono>

namespace relmap::testing {

// So long that tests come to its end only if something hangs, also on a machine that is busy with something else.
constexpr std::chrono::minutes kPatience{10};

}  // namespace relmap::testing
