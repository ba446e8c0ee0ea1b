// Which map a daemon serves, so that a robot that was in one does not go on in another.
#pragma once

#include <cstdint>

#include "proto/base/ids.h"

namespace relmap {

struct MapIdentity {
  Uuid uuid;  // random, drawn once for each map; nil: not known (no map yet, or one of a daemon that does not say it)
  // When this history of the map began, in microseconds UTC: with the map, or where it was restored from a backup. A
  // restore raises it, so the map that goes on without what came after the backup is told from the one that had it.
  std::uint64_t epoch = 0;

  bool operator==(const MapIdentity&) const = default;
  bool known() const { return !uuid.is_nil(); }
};

}  // namespace relmap
