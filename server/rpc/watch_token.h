// The token of an event that a watcher received: where in which map's log it goes on.
#pragma once

#include <string>
#include <string_view>

#include "proto/base/map_identity.h"
#include "proto/base/status.h"
#include "storage/events/event.h"

namespace relmap::rpc {

struct WatchToken {
  MapIdentity map;
  storage::EventPosition at;  // of the last event that was told

  bool operator==(const WatchToken&) const = default;
};

// "VERSION.UUID.EPOCH.OWNER.SEQUENCE.ORDINAL.CHECK": the map, the owner of the journal (0: the only one there is;
// docs/storage-format.md), the position, and the CRC32C of all before the last point. Numbers are decimal, uuid and
// check hexadecimal.
std::string watch_token_text(const WatchToken& token);

// INVALID_ARGUMENT if it is not a token of WatchMap, was mangled, or is one of a later version.
Result<WatchToken> read_watch_token(std::string_view text);

}  // namespace relmap::rpc
