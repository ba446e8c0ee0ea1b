// What one caller may cost.
#pragma once

#include <cstddef>
#include <cstdint>

namespace relmap::rpc {

struct RpcLimits {
  int threads = 4;                               // that run handlers (pictures have one more of their own)
  int max_concurrent = 64;                       // RPCs running, waiting or streaming; beyond it BUDGET_EXCEEDED
  int max_ingest_streams = 256;                  // beside them
  int max_pictures = 16;                         // of them, with a picture
  std::uint64_t max_search_frames = 10'000'000;  // per route or transform: OUT_OF_REACH
  std::uint64_t near_route_steps = 50;           // of a route by cells that is searched again with bound closures
  double default_deadline_s = 60;                // for callers that set none
  std::size_t route_steps_per_message = 1000;    // of a stream, at most
};

// Of a stream. What a slow caller has not taken is one message, once as we made it and once as gRPC sends it.
inline constexpr std::size_t kUsualStreamMessageBytes = 256u << 10;

}  // namespace relmap::rpc
