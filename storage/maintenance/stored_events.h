// The log of events in a snapshot, read past whatever is damaged.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "proto/base/reason.h"
#include "storage/engine/engine.h"
#include "storage/events/event_block.h"

namespace relmap::storage {

struct EventDamage {
  Reason reason = Reason::DATA_LOSS;
  std::string key;   // of the record that is damaged; empty: the rest of the log cannot be read
  std::string what;  // "events up to 120:3: CORRUPT: ..."
  bool head = false;
};

// Checks every block, one at a time: whole, ascending, and of nothing beyond `applied_sequence`; and that the head says
// where the log begins and ends. Returns the head as it ought to be; nullopt: there is no log.
std::optional<EventLogHead> check_events(const EngineSnapshot& snapshot, std::uint64_t applied_sequence,
                                         const std::function<void(const EventDamage&)>& damaged);

}  // namespace relmap::storage
