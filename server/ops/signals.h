// SIGTERM and SIGINT, taken by a thread that waits for them instead of a handler.
#pragma once

#include <chrono>
#include <optional>

namespace relmap::ops {

// Blocks SIGTERM and SIGINT and ignores SIGPIPE, in this thread and all that it starts. Call it before the first
// thread starts.
void block_stop_signals();

// Waits for SIGTERM or SIGINT and returns its number; nullopt after `timeout`. A second one then ends the process at
// once, as if unhandled: what was acknowledged is in the journal.
std::optional<int> wait_for_stop_signal(std::chrono::milliseconds timeout);

}  // namespace relmap::ops
