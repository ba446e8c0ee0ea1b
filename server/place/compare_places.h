// Decides by descriptors (likeness.h) and Bayes' rule which of the shortlisted places a picture shows.
#pragma once

#include "server/place/likeness.h"
#include "server/place/place_index.h"
#include "server/place/shortlist.h"

namespace relmap::place {

// The minimum number of groups of places among which common features can be told from distinctive ones. With fewer
// groups, words alone decide.
inline constexpr std::uint32_t kMinGroups = 4;

// Reads the features of the places from the graph. A place whose features are lost (DATA_LOSS) has likeness 0. Throws
// StatusError where other reads of the graph do.
PlaceAnswer compare_places(const DescribedWords& query, const Shortlist& shortlist, const storage::Graph& graph);

}  // namespace relmap::place
