// The landmarks round the robot, in the frame of the last keyframe, and how they fare from pair to pair.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "frontend/tracking/landmark.h"
#include "frontend/tracking/matching.h"
#include "frontend/tracking/pair.h"
#include "frontend/vision/spread.h"
#include "proto/keyframe/keyframe.h"

namespace relmap::tracking {

class LocalLandmarks {
 public:
  explicit LocalLandmarks(const StereoCamera& camera) : camera_(camera) {}

  std::span<const Landmark> all() const { return landmarks_; }
  const Landmark& operator[](std::size_t i) const { return landmarks_[i]; }
  std::size_t size() const { return landmarks_.size(); }
  void clear() { landmarks_.clear(); }
  double median_depth() const;  // metres; 0 without landmarks

  // Counts who was found; who is missed too often is dropped. The sightings keep pointing at the right ones.
  void note(std::vector<Sighting>& sightings);

  // The frame of `pair`, at `T_keyframe_pair`, becomes the last keyframe: landmarks move to it and take in what was
  // measured there, with `sigma` pixels a coordinate on level 0. Sightings of landmarks that are passed are dropped.
  void rebase(const SE3& T_keyframe_pair, const Pair& pair, double sigma, std::vector<Sighting>& sightings);

  // New ones at `corners` of the pair, but not beside the points to `avoid`, until `wanted` are seen; adds the
  // sightings of the new. `offset`: pixels to be taken off measured disparities.
  void replenish(const Pair& pair, const std::vector<std::vector<vision::Corner>>& corners,
                 std::span<const vision::PicturePoint> avoid, int wanted, double sigma, double offset,
                 std::vector<Sighting>& sightings);

  // As keyframe `sequence` states them; landmarks that are stated for the first time become tracks of it.
  std::vector<TrackMeasurement> state(std::uint32_t sequence, std::span<const Sighting> sightings);

 private:
  StereoCamera camera_;
  std::vector<Landmark> landmarks_;
};

}  // namespace relmap::tracking
