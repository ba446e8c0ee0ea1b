// Frames that wait for relaxation, as they are stored: by chunk, each chunk when it changes.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "storage/engine/engine.h"
#include "storage/graph/frame_set.h"

namespace relmap::storage {

// Reads them into `pending`. A record that cannot be read is left out; `damaged` is called with its key and with what
// is wrong. IO_ERROR.
Status load_pending(const EngineSnapshot& snapshot, FrameSet& pending,
                    const std::function<void(std::string_view key, const std::string& what)>& damaged);

// Appends the puts and deletes for the chunks that have changed.
void write_pending(const FrameSet& pending, std::vector<Put>& puts, std::vector<std::string>& deletes);

}  // namespace relmap::storage
