// Which places in metres could a picture show? Photographs of the same places compete for nothing here.
#pragma once

#include <span>

#include "server/place/place_index.h"

namespace relmap::place {

// `answer`, of PlaceIndex::query() with the same question; asked once more without mono sessions if any are among its
// candidates: their frames take no probability from others, and no room.
PlaceAnswer metric_answer(PlaceAnswer answer, const PlaceIndex& places, std::span<const std::uint32_t> words,
                          const storage::Graph& graph, std::span<const storage::FrameRange> masked,
                          std::span<const AppearanceFeature> features);

}  // namespace relmap::place
