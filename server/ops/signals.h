// Handles SIGTERM, SIGINT and SIGHUP by a thread that waits for them instead of a signal handler.
#pragma once

#include <chrono>
#include <optional>

namespace relmap::ops {

// Blocks these signals in this thread and all that it starts, and ignores SIGPIPE. Call it before the first thread
// starts.
void block_stop_signals();

// Whether SIGTERM or SIGINT has come and wait_for_signal() has not returned it yet. Thread-safe.
bool is_told_to_stop();

// Waits for one of them and returns its number; nullopt after `timeout`. After it has returned SIGTERM or SIGINT,
// another one of these ends the process at once. That loses nothing acknowledged, since it is in the journal.
std::optional<int> wait_for_signal(std::chrono::milliseconds timeout);

}  // namespace relmap::ops
