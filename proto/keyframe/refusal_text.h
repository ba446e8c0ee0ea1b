// Why keyframes are refused for good, in words for whoever looks after the robot.
#pragma once

#include <string_view>

#include "proto/base/reason.h"

namespace relmap {

// A clause about a keyframe that was refused for this reason, or about its session; empty for a reason for which none
// is.
std::string_view refusal_text(Reason reason);

}  // namespace relmap
