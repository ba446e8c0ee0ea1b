// Which places in metres could a picture show? Photographs of the same places compete for nothing here.
#pragma once

#include <span>

#include "server/place/place_index.h"

namespace relmap {

// PlaceIndex::query() with the mono sessions that it finds left out, of as many as rounds find: their frames take no
// probability from others, and no room among the candidates.
PlaceAnswer query_metric(const PlaceIndex& places, std::span<const std::uint32_t> words, const Graph& graph,
                         std::span<const FrameRange> masked = {}, std::span<const AppearanceFeature> features = {});

}  // namespace relmap
