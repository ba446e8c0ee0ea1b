// The limit of a search, which makes every search over the map end, whatever the size of the map.
#pragma once

#include <cstddef>
#include <functional>

#include "proto/base/status.h"

namespace relmap::route {

struct WorkLimit {
  // Frames that a search may touch before it ends with OUT_OF_REACH.
  std::size_t max_frames = 10'000'000;
  // Called every kWorkStride frames with the number of bytes that the search holds. A status that is not ok (DEADLINE,
  // BUDGET_EXCEEDED, SHUTTING_DOWN) ends the search with that status.
  std::function<Status(std::size_t bytes)> proceed;
};
inline constexpr std::size_t kWorkStride = 128;

}  // namespace relmap::route
