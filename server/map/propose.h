// Proposes a loop closure between two frames that an operator names. Geometry decides whether they show the same place,
// as it does for recognised places (lookup.h).
#pragma once

#include "server/place/picture_cache.h"
#include "server/place/place_index.h"
#include "storage/graph/graph.h"
#include "storage/journal/journal_record.h"

namespace relmap::map {

// Verifies the newer frame's picture around the older frame or, if that fails, the older's around the newer. The ends
// of the proposal may be neighbours of the named frames that saw more of the place; its uniqueness is not known.
// NO_SUCH_FRAME, SESSION_DELETED, INVALID_ARGUMENT (the same frame twice, or one in the other's recent past),
// NOT_STEREO (a frame of a mono session has no metres), NO_CALIBRATION (imported without a camera), WRONG_STATE (the
// closure exists), or the reason of verify_place(), with messages for both directions.
Result<storage::ClosureProposalRecord> propose_closure(const storage::Graph& view, const place::PlaceIndex& places,
                                                       place::PictureCache& pictures, FrameId a, FrameId b);

// The closure from `query` to `match`, in any state; nullopt if none is stored.
std::optional<storage::Edge> closure_between(const storage::Graph& graph, FrameId query, FrameId match);

}  // namespace relmap::map
