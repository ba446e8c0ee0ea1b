// What a start makes of the map's frames: places of the place index, and lookups that were not finished.
#pragma once

#include <cstdint>
#include <set>
#include <span>

#include "proto/base/ids.h"
#include "proto/base/status.h"
#include "server/map/lookup_queue.h"
#include "server/map/recovery.h"
#include "server/place/place_index.h"
#include "server/place/vocabulary.h"
#include "storage/map/map.h"
#include "storage/memory/budget.h"

namespace relmap::map {

// Opens the frames whose lookup may not have been made, or may not have reached the journal: `known`, which were open
// at the last commit (MapState::lookups), and those that the journal added since. A proposal made twice changes
// nothing. `deterministic`: the caller looks them up itself, and had made every lookup before the next keyframe was
// taken in.
void find_open_lookups(const std::set<FrameId>& known, const Replayed& replayed, bool deterministic,
                       LookupQueue& lookups);

// Makes a place of every frame with words: from the index's folder, or else from the map. Frames whose lookup is open
// are left out; they become places when they are looked up. IO_ERROR, DATA_LOSS, VIEW_EXPIRED: the words could not all
// be read, so some places would silently not be recognised.
Status index_known_places(const storage::MapView& view, const place::Vocabulary& vocabulary, const LookupQueue& lookups,
                          place::PlaceIndex& places, storage::Budget& budget);

// Adds a place and charges the index's memory to the budget. The first place for which there is no room is logged.
void add_place(place::PlaceIndex& places, storage::Budget& budget, FrameId frame, std::span<const std::uint32_t> words);

}  // namespace relmap::map
