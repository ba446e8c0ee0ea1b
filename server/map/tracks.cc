#include "server/map/tracks.h"

#include <algorithm>

#include "server/rba/measurement.h"

namespace relmap::map {

std::optional<FrameId> previous_frame(const storage::Graph& graph, FrameId id) {
  const auto hot = graph.hot(id);
  if (!hot || hot->edges.empty() || hot->edges.front().id.ordinal != 0) return std::nullopt;
  return hot->edges.front().a;
}

std::unordered_map<TrackId, LandmarkId> live_tracks(const storage::Graph& graph, FrameId newest) {
  std::unordered_map<TrackId, LandmarkId> tracks;
  std::optional<FrameId> frame = newest;
  for (std::uint32_t n = 0; frame && n < kTrackMemory; ++n, frame = previous_frame(graph, *frame)) {
    const auto warm = graph.warm(*frame);
    std::shared_ptr<const storage::FrameHot> base;
    FrameId base_id;
    for (const storage::Observation& observation : warm->observations) {
      if (!observation.is_tracked()) continue;  // bound, not tracked
      if (!base || base_id != observation.landmark.base) {
        base_id = observation.landmark.base;
        base = graph.hot(base_id);
      }
      tracks.try_emplace(base->landmarks[observation.landmark.slot].track, observation.landmark);  // newest first
    }
  }
  return tracks;
}

storage::Landmark start_landmark(const StereoCamera& camera, const TrackMeasurement& measurement) {
  storage::Landmark landmark;
  landmark.track = measurement.track;
  const StereoPixel z = measurement.pixel();
  landmark.depth_prior = is_mono(z) || !camera.is_stereo();
  const double rho = landmark.depth_prior ? 0.1 : (z.x() - z.z()) / (camera.f * camera.baseline);
  landmark.abr = {(z.x() - camera.cx) / camera.f, (z.y() - camera.cy) / camera.f, std::max(rho, rba::kMinInverseDepth)};
  return landmark;
}

}  // namespace relmap::map
