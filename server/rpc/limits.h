// Limits on what callers may cost.
#pragma once

#include <cstddef>
#include <cstdint>

namespace relmap::rpc {

struct RpcLimits {
  int threads = 4;                         // threads that run handlers; pictures have another of their own
  int max_concurrent = 64;                 // RPCs that run, wait or stream; beyond it BUDGET_EXCEEDED
  int max_concurrent_per_caller = 48;      // of max_concurrent
  int max_ingest_streams = 256;            // not counted in max_concurrent
  int max_ingest_streams_per_caller = 64;  // of max_ingest_streams
  int max_watchers = 256;                  // watches of the map; not counted in max_concurrent either
  int max_watchers_per_caller = 64;        // of max_watchers
  int max_waiting = 64;                    // edits, and again calls of WaitIdle, that wait; not counted there either
  double stalled_s = 30;                   // a call is ended whose caller has not taken a message for so long
  int max_pictures = 16;                   // RPCs with a picture, of max_concurrent
  std::uint64_t max_search_frames = 10'000'000;  // frames of a search; beyond it OUT_OF_REACH
  std::uint64_t near_route_steps = 50;           // routes by cells up to this length are searched again near the start
  double default_deadline_s = 60;                // for callers that set none
  std::size_t route_steps_per_message = 1000;    // steps in a message of a stream, at most
};

// Sessions that a request may name.
inline constexpr int kMaxNamedSessions = 10'000;

// Usual size of a message of a stream. A slow caller holds one message, once as we made it and once as gRPC sends it.
inline constexpr std::size_t kUsualStreamMessageBytes = 256u << 10;

}  // namespace relmap::rpc
