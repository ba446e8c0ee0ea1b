// The head of the log of events in a snapshot.
#pragma once

#include <optional>

#include "storage/engine/engine.h"
#include "storage/events/event_block.h"

namespace relmap::storage {

// Nullopt: the map has told nothing yet, or the head is lost. IO_ERROR, DATA_LOSS, and the reasons of
// decode_event_head(). Thread-safe.
Result<std::optional<EventLogHead>> load_event_head(const EngineSnapshot& snapshot);

}  // namespace relmap::storage
