// Which of the shortlisted places does a picture show? By likeness.h, and Bayes' rule.
#pragma once

#include "server/place/likeness.h"
#include "server/place/place_index.h"
#include "server/place/shortlist.h"

namespace relmap::place {

// What is common can be told from what is distinct among so many groups of places at least; of fewer, words tell.
inline constexpr std::uint32_t kMinGroups = 4;

// Reads the features of the places from the graph; of one whose features are lost nothing is like the query. Throws
// StatusError where other reads of the graph do.
PlaceAnswer compare_places(const DescribedWords& query, const Shortlist& shortlist, const storage::Graph& graph);

}  // namespace relmap::place
