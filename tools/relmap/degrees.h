// Angles are shown in degrees.
#pragma once

#include <numbers>

namespace relmap::cli {

inline constexpr double kDegrees = 180 / std::numbers::pi;  // in a radian

}  // namespace relmap::cli
