// How far a search may go: every search over the map ends, whatever the size of the map.
#pragma once

#include <cstddef>
#include <functional>

#include "proto/base/status.h"

namespace relmap::route {

struct WorkLimit {
  // Frames that a search may touch before it answers OUT_OF_REACH.
  std::size_t max_frames = 10'000'000;
  // Asked every kWorkStride frames with the bytes that the search holds; a status that is not ok (DEADLINE,
  // BUDGET_EXCEEDED, SHUTTING_DOWN) ends the search with it.
  std::function<Status(std::size_t bytes)> proceed;
};
inline constexpr std::size_t kWorkStride = 128;

}  // namespace relmap::route
