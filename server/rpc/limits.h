// What one caller may cost.
#pragma once

#include <cstddef>
#include <cstdint>

namespace relmap {

struct RpcLimits {
  int threads = 4;                              // that run handlers (pictures have one more of their own)
  int max_concurrent = 64;                      // RPCs running, waiting or streaming; beyond it BUDGET_EXCEEDED
  int max_pictures = 16;                        // of them, with a picture
  std::uint64_t max_search_frames = 10'000'000;  // per route or transform: OUT_OF_REACH
  double default_deadline_s = 60;                // for callers that set none
};

inline constexpr std::size_t kMaxStreamMessageBytes = 1u << 20;

}  // namespace relmap
