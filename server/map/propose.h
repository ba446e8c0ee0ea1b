// A loop closure between two frames that somebody names: whether they show the same place, geometry says, as it does of
// what was recognised (lookup.h).
#pragma once

#include "server/place/picture_cache.h"
#include "server/place/place_index.h"
#include "storage/graph/graph.h"
#include "storage/journal/journal_record.h"

namespace relmap::map {

// Of what the newer of the two saw, looked for around the older; or else the other way round. Its ends may be frames
// beside those that are named, which saw more of the place; its uniqueness is not known. NO_SUCH_FRAME,
// SESSION_DELETED, INVALID_ARGUMENT (a frame and itself, or its own recent past), NOT_STEREO (a mono session's: no
// metres), NO_CALIBRATION (imported without a camera), WRONG_STATE (there is a closure between the two), and what
// verify_place() says, of both directions.
Result<storage::ClosureProposalRecord> propose_closure(const storage::Graph& view, const place::PlaceIndex& places,
                                                       place::PictureCache& pictures, FrameId a, FrameId b);

// The closure between two frames; nullopt: none is stored.
std::optional<storage::Edge> closure_between(const storage::Graph& graph, FrameId query, FrameId match);

}  // namespace relmap::map
