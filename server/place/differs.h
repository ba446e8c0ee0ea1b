// What two views that geometry takes for one place show differently.
#pragma once

#include "server/place/verify.h"

namespace relmap::place {

// The picture in 8 x 6 cells: of those in which both the query shows features and the map says that points should be
// seen, three of each at least and from about as near, the share in which not one is found again. Negative: there are
// fewer than eight such cells, or no pose.
float differing_share(const storage::Graph& graph, const QueryPicture& query, const VerifiedPlace& place);

}  // namespace relmap::place
