// How numbers are presented in all reports and summaries.
#pragma once

#include <cstdint>
#include <numbers>

namespace relmap::frontend {

inline constexpr double kDegrees = 180 / std::numbers::pi;  // per radian

// part / whole; 1 if `whole` is 0.
inline double share(std::uint64_t part, std::uint64_t whole) {
  return whole == 0 ? 1 : static_cast<double>(part) / static_cast<double>(whole);
}

}  // namespace relmap::frontend
