// Finds the landmark that a robot's track continues, and the position of a new landmark.
#pragma once

#include <unordered_map>

#include "storage/map/map.h"

namespace relmap::map {

// The landmarks of the tracks in the last `kTrackMemory` frames of a session. A track that pauses for longer starts a
// new landmark.
inline constexpr std::uint32_t kTrackMemory = 8;
std::unordered_map<TrackId, LandmarkId> live_tracks(const storage::Graph& graph, FrameId newest);

// A new landmark in the frame that first sees it: at the depth of the stereo measurement, or at 10 m with a depth
// prior.
storage::Landmark start_landmark(const StereoCamera& camera, const TrackMeasurement& measurement);

// The frame that the odometry edge into `id` comes from; nullopt if there is none.
std::optional<FrameId> previous_frame(const storage::Graph& graph, FrameId id);

}  // namespace relmap::map
