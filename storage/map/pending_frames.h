// Frames that wait for relaxation, as they are written down: chunk by chunk, those that changed.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "storage/engine/engine.h"
#include "storage/graph/frame_set.h"

namespace relmap::storage {

// IO_ERROR. A record that cannot be read is left out, and `damaged` told its key and what is wrong.
Status load_pending(const EngineSnapshot& snapshot, FrameSet& pending,
                    const std::function<void(std::string_view key, const std::string& what)>& damaged);

void write_pending(const FrameSet& pending, std::vector<Put>& puts, std::vector<std::string>& deletes);

}  // namespace relmap::storage
