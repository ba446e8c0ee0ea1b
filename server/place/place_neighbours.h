// Which frames show the same place: those a few steps away in the graph.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "storage/graph/graph.h"

namespace relmap::place {

inline constexpr std::uint32_t kPlaceRadius = 5;  // edges

// Pictures of one camera: no edges, no landmarks. False where there is no such session.
bool is_mono_session(const storage::Graph& graph, SessionNumber session);

// Of a mono session: the frame before, unless more than 3 are missing between the two; and the one after.
std::optional<FrameId> previous_of(const storage::Graph& graph, FrameId frame);
std::optional<FrameId> next_of(const storage::Graph& graph, FrameId frame);

// Frames within `radius` steps of `centre`, itself first, in the order of discovery; some 1,000 of them at most. A step
// is an accepted edge; in a mono session, which has no edges, it is the next or the previous frame.
std::vector<FrameId> place_neighbours(const storage::Graph& graph, FrameId centre, std::uint32_t radius);

}  // namespace relmap::place
