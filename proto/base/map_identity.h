// Which map a daemon serves, so that a robot does not continue a session in another map.
#pragma once

#include <cstdint>

#include "proto/base/ids.h"

namespace relmap {

struct MapIdentity {
  Uuid uuid;  // random, drawn once for each map; nil: not known (no map yet, or an older daemon does not report it)
  // When the map was made or last restored from a backup, in microseconds UTC. A restored map has lost what came after
  // the backup; its higher epoch tells it from the original.
  std::uint64_t epoch = 0;

  bool operator==(const MapIdentity&) const = default;
  bool known() const { return !uuid.is_nil(); }
};

}  // namespace relmap
