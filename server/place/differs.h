// Measures how much two views differ that geometry takes for one place.
#pragma once

#include "server/place/verify.h"

namespace relmap::place {

// Returns the share (0..1) of cells of the query's picture that differ from the map. The picture is divided into 8 x 6
// cells; a cell is compared if the query has at least three features in it and the map expects at least three points
// there that were seen from about the same distance. A compared cell differs if none of these points is found again.
// Returns -1 if fewer than eight cells can be compared, the pose is not metric or the focal length is unknown.
float differing_share(const storage::Graph& graph, const QueryPicture& query, const VerifiedPlace& place);

}  // namespace relmap::place
