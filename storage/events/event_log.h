// The log of events, as those who watch the map read it. It is part of the map: its blocks stand under keys of their
// own and are written in the commit of what they tell (event_writer.h). Of the log, the last hour is kept, or less if
// that is more than its room.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "storage/engine/engine.h"
#include "storage/events/event.h"

namespace relmap::storage {

struct EventLimits {
  std::uint64_t max_bytes = std::uint64_t{64} << 20;
  std::int64_t max_age_us = 3600 * std::int64_t{1000000};
};

struct EventsRead {
  std::vector<Event> events;  // ascending
  bool more = false;          // there are more in this snapshot
  // The log no longer has all that came after the given position: `events` begin with the oldest that is kept.
  bool gap = false;
  // Where to read on: the last of `events`, or what is damaged behind them; the given position if there was nothing.
  EventPosition through;
};

// Reads the events after `after`, as many as have about `max_bytes` on disk, at least one if there is one. The position
// {} is before all events: it never finds a gap. A damaged block is a gap: what is before it is told first, and the
// next call goes on behind it. Of the log, only what is told is read and decoded. IO_ERROR; DATA_LOSS if the log cannot
// be read at all. Thread-safe.
Result<EventsRead> read_events(const EngineSnapshot& snapshot, EventPosition after, std::size_t max_bytes);

// The position of the newest event; {} if there is none. IO_ERROR, DATA_LOSS.
Result<EventPosition> newest_event(const EngineSnapshot& snapshot);

}  // namespace relmap::storage
