// How figures are put, in every report and summary alike.
#pragma once

#include <cstdint>
#include <numbers>

namespace relmap::frontend {

inline constexpr double kDegrees = 180 / std::numbers::pi;  // in a radian

// Of nothing: all.
inline double share(std::uint64_t part, std::uint64_t whole) {
  return whole == 0 ? 1 : static_cast<double>(part) / static_cast<double>(whole);
}

}  // namespace relmap::frontend
