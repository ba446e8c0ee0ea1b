// The answer of the place index without mono sessions, for callers that need a metric pose: photographs of the same
// places do not compete with them.
#pragma once

#include <span>

#include "server/place/place_index.h"

namespace relmap::place {

// Returns `answer`, which PlaceIndex::query() gave to the same question, if no candidate is of a mono session.
// Otherwise asks again without mono sessions, so that their frames take no probability and no room from the others.
PlaceAnswer metric_answer(PlaceAnswer answer, const PlaceIndex& places, std::span<const std::uint32_t> words,
                          const storage::Graph& graph, std::span<const storage::FrameRange> masked,
                          std::span<const AppearanceFeature> features);

}  // namespace relmap::place
