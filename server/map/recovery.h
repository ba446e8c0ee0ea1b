// Crash recovery: re-applies the journal's records after the last commit, and finds the lookups that were not finished.
#pragma once

#include <cstdint>
#include <set>
#include <vector>

#include "proto/base/ids.h"
#include "proto/base/status.h"
#include "server/map/lookup_queue.h"
#include "server/map/map_builder.h"
#include "storage/engine/engine.h"
#include "storage/graph/graph.h"

namespace relmap::map {

struct Replayed {
  std::vector<FrameId> frames;  // frames that the records added, in the order of the journal
  // False if the last record added a frame. In deterministic mode a frame is looked up before the next record is
  // journalled: if any record follows the last frame, that frame's lookup was done; if none does, it may be missing.
  bool looked_up = true;
  // Not ok: the journal was not applied to its end. The engine's or the map's own status if something could not be
  // read; DATA_LOSS if a record does not decode; INTERNAL for any other exception. The map must not be published then:
  // the last record may be half applied.
  Status trouble;
};

// Applies the journal's records from `from` on. Does not throw: failures are in `trouble`, so that the daemon still
// starts, read-only.
Replayed replay(const storage::Engine& engine, std::uint64_t from, MapBuilder& builder);

// Opens the frames whose lookup may not have been made, or may not have reached the journal: `known`, which were open
// at the last commit (MapState::lookups), and those that the journal added since. They are pushed in the order in which
// `graph` took them in: each is then looked up among the same older frames as before, and a proposal made twice changes
// nothing. `deterministic`: the caller looks them up itself, and had made every lookup before the next keyframe was
// taken in.
void find_open_lookups(const storage::Graph& graph, const std::set<FrameId>& known, const Replayed& replayed,
                       bool deterministic, LookupQueue& lookups);

}  // namespace relmap::map
