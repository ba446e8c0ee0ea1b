// Handles SIGTERM and SIGINT by a thread that waits for them instead of a signal handler.
#pragma once

#include <chrono>
#include <optional>

namespace relmap::ops {

// Blocks SIGTERM and SIGINT in this thread and all that it starts, and ignores SIGPIPE. Call it before the first thread
// starts.
void block_stop_signals();

// Waits for SIGTERM or SIGINT and returns its number; nullopt after `timeout`. After it has returned a signal, another
// one ends the process at once. That loses nothing acknowledged, since it is in the journal.
std::optional<int> wait_for_stop_signal(std::chrono::milliseconds timeout);

}  // namespace relmap::ops
