// Finds the frames that show the same place as a frame: those a few steps away in the graph.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "storage/graph/graph.h"

namespace relmap::place {

inline constexpr std::uint32_t kPlaceRadius = 5;  // edges

// Whether a session is of a single camera: then it has no edges and no landmarks. False if there is no such session.
bool is_mono_session(const storage::Graph& graph, SessionNumber session);

// The previous and the next frame of a mono session; nullopt if more than 3 frames are missing between the two.
std::optional<FrameId> previous_of(const storage::Graph& graph, FrameId frame);
std::optional<FrameId> next_of(const storage::Graph& graph, FrameId frame);

// Returns the frames within `radius` steps of `centre`, in the order of discovery with `centre` first. Stops at about
// 1,000. A step is an accepted edge or, in a mono session, which has no edges, the next or previous frame.
std::vector<FrameId> place_neighbours(const storage::Graph& graph, FrameId centre, std::uint32_t radius);

// The same, but steps at which the robot stood still do not count: where it stands is one place. Lookups propose no
// closure between such frames (server/map/lookup.h, first_recent()), so nothing else joins them.
std::vector<FrameId> place_neighbours_driven(const storage::Graph& graph, FrameId centre, std::uint32_t radius);

}  // namespace relmap::place
