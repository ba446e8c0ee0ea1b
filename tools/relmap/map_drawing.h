// The relaxed graph as a picture (client/map_picture.h).
#pragma once

#include <cstdint>
#include <unordered_map>

#include "client/map_picture.h"
#include "tools/relmap/relaxed_map.h"

namespace relmap::cli {

// All parts with their labels and closures, coloured by session. `removed`: with closures that were removed.
client::MapPicture picture_of(const RelaxedMap& map, bool removed);

// Marks the tears, and lists the closures that are stretched most.
void mark_tears(const RelaxedMap& map, client::MapPicture& picture);
// When each frame was taken.
void colour_by_time(const RelaxedMap& map, client::MapPicture& picture);
// How well the position of each frame relative to the root of its part is known (client/path_uncertainty.h).
void colour_by_uncertainty(const RelaxedMap& map, client::MapPicture& picture);

// When each frame of the graph was taken, microseconds UTC: as its edges tell, or, of an older daemon, between the
// first and the last frame of its session in proportion.
std::unordered_map<FrameId, std::int64_t> frame_times(const MapGraph& graph);

// Of each frame of the part, in its order: the standard deviation of its position relative to the part's root, metres;
// infinite where steps that nothing measured lie between.
std::vector<double> uncertainty_of(const RelaxedMap& map, const MapPart& part);

}  // namespace relmap::cli
