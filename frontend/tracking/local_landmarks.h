// The landmarks around the robot, in the frame of the last keyframe, with their bookkeeping from pair to pair.
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

  // Notes which landmarks were found, and drops those that were missed in three pairs in a row. Updates the indices of
  // the sightings.
  void note(std::vector<Sighting>& sightings);

  // Makes the frame of `pair`, at `T_keyframe_pair`, the last keyframe: transforms the landmarks to it and updates them
  // with the sightings, whose standard deviation is `sigma` pixels a coordinate on level 0. Removes the sightings of
  // landmarks that the robot has passed.
  void rebase(const SE3& T_keyframe_pair, const Pair& pair, double sigma, std::vector<Sighting>& sightings);

  // Starts new landmarks at `corners` of the pair, away from the points to `avoid`, until `wanted` are seen, and adds
  // their sightings. `offset` pixels are subtracted from measured disparities.
  void replenish(const Pair& pair, const std::vector<std::vector<vision::Corner>>& corners,
                 std::span<const vision::PicturePoint> avoid, int wanted, double sigma, double offset,
                 std::vector<Sighting>& sightings);

  // The sightings as track measurements of keyframe `sequence`. A landmark's first one gives its track a name.
  std::vector<TrackMeasurement> track_measurements(std::uint32_t sequence, std::span<const Sighting> sightings);

 private:
  StereoCamera camera_;
  std::vector<Landmark> landmarks_;
};

}  // namespace relmap::tracking
