// Which places in metres could a picture show? Photographs of the same places compete for nothing here.
#pragma once

#include <span>

#include "server/place/place_index.h"

namespace relmap {

// PlaceIndex::query() without mono sessions: their frames take no probability from others, and no room among the
// candidates. Asks a second time if there are any among them.
PlaceAnswer query_metric(const PlaceIndex& places, std::span<const std::uint32_t> words, const Graph& graph,
                         std::span<const FrameRange> masked = {}, std::span<const AppearanceFeature> features = {});

}  // namespace relmap
