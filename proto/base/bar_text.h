// Bars drawn with characters: "[######......]".
#pragma once

#include <cstdint>
#include <string>

namespace relmap {

// A bar of `width` characters between the brackets, the first `filled` of which are filled; all if `filled` is more.
std::string filled_bar_text(std::uint64_t filled, std::uint64_t width);

// The same for work of which `done` of `total` is done. The filled length is rounded down, so that only the bar of
// finished work is full. Empty if `total` is 0, which means that it is not known.
std::string progress_bar_text(std::uint64_t done, std::uint64_t total, std::uint64_t width);

}  // namespace relmap
