// What a start makes of the journal: the records beyond the last commit are applied again.
#pragma once

#include <cstdint>
#include <vector>

#include "proto/base/ids.h"
#include "proto/base/status.h"
#include "server/map/map_builder.h"
#include "storage/engine/engine.h"

namespace relmap::map {

struct Replayed {
  std::vector<FrameId> frames;  // that were taken in, in the order of the journal
  // Whether anything came after the last of them. In deterministic mode its lookup was then done: what comes next has
  // to wait for it.
  bool looked_up = true;
  // Not ok: why the journal was not applied to its end. What could not be read says so itself; DATA_LOSS, a record that
  // is none; INTERNAL, one that cannot be applied. The map must not be published then.
  Status trouble;
};

// Applies the journal's records from `from` on. Throws nothing: a record that cannot be applied must not end the start.
Replayed replay(const storage::Engine& engine, std::uint64_t from, MapBuilder& builder);

}  // namespace relmap::map
