// Which landmark does a track of the wire continue, and where does a new one lie?
#pragma once

#include <unordered_map>

#include "storage/map/map.h"

namespace relmap::map {

// The landmarks that the tracks of a session's last frames stand for. A track that pauses for more than `kTrackMemory`
// frames starts a new landmark.
inline constexpr std::uint32_t kTrackMemory = 8;
std::unordered_map<TrackId, LandmarkId> live_tracks(const storage::Graph& graph, FrameId newest);

// A landmark at its first sight, in the frame that sees it: by stereo, else at 10 m with a depth prior.
storage::Landmark start_landmark(const StereoCamera& camera, const TrackMeasurement& measurement);

// The frame that precedes `id` in its session and is present; nullopt: it is the first.
std::optional<FrameId> previous_frame(const storage::Graph& graph, FrameId id);

}  // namespace relmap::map
