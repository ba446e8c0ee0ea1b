#include "frontend/tracking/local_landmarks.h"

#include <utility>

#include "frontend/tracking/new_landmarks.h"
#include "proto/base/quantile.h"

namespace relmap::tracking {

namespace {

constexpr int kMaxMissed = 2;          // consecutive pairs; a landmark that is missed in more is dropped
constexpr double kForgetting = 0.06;   // pixels added to a landmark's uncertainty at each keyframe
constexpr double kPassed = 0.1;        // metres before the camera
constexpr double kAnchorScale = 1.25;  // a larger change of size needs a new anchor
constexpr double kAnchorTurn = 0.2;    // radians; so does a larger rotation

}  // namespace

double LocalLandmarks::median_depth() const {
  if (landmarks_.empty()) return 0;
  std::vector<double> depths;
  depths.reserve(landmarks_.size());
  for (const Landmark& landmark : landmarks_) depths.push_back(landmark.point.z());
  return upper_median(std::move(depths));
}

void LocalLandmarks::note(std::vector<Sighting>& sightings) {
  std::vector<char> seen(landmarks_.size(), 0);
  for (const Sighting& s : sightings) seen[s.landmark] = 1;
  std::vector<std::uint32_t> moved(landmarks_.size());
  std::size_t kept = 0;
  for (std::size_t i = 0; i < landmarks_.size(); ++i) {
    landmarks_[i].missed = seen[i] ? 0 : landmarks_[i].missed + 1;
    if (landmarks_[i].missed > kMaxMissed) continue;
    moved[i] = static_cast<std::uint32_t>(kept);
    if (kept != i) landmarks_[kept] = std::move(landmarks_[i]);
    ++kept;
  }
  landmarks_.resize(kept);
  for (Sighting& s : sightings) s.landmark = moved[s.landmark];
}

void LocalLandmarks::rebase(const SE3& T_keyframe_pair, const Pair& pair, double sigma,
                            std::vector<Sighting>& sightings) {
  const SE3 T_new_old = T_keyframe_pair.inverse();
  for (Landmark& landmark : landmarks_) {
    landmark.point = T_new_old * landmark.point;
    landmark.covariance = (T_new_old.R * landmark.covariance * T_new_old.R.transpose()).eval();
    landmark.R_anchor_keyframe *= T_keyframe_pair.R;
    ++landmark.age;
  }
  for (const Sighting& s : sightings) {
    Landmark& landmark = landmarks_[s.landmark];
    StereoEstimate estimate = to_pixels(camera_, landmark.point, landmark.covariance);
    const double forgetting = kForgetting * pixel_sigma(landmark.level);
    estimate.covariance.diagonal().array() += forgetting * forgetting;
    if (estimate.pixel.x() > estimate.pixel.z()) {
      Vector3 point;
      Matrix3 covariance;
      from_pixels(camera_, estimate, point, covariance);
      if (join_measurement(camera_, s.pixel, sigma * pixel_sigma(landmark.level), point, covariance)) {
        landmark.point = point;
        landmark.covariance = covariance;
      }
    }
    const double scale = landmark.point.z() / landmark.anchor_depth;
    if (scale > kAnchorScale || scale * kAnchorScale < 1 || rotation_angle(landmark.R_anchor_keyframe) > kAnchorTurn)
      landmark.take_anchor(pair.left.level(landmark.level),
                           vision::to_level(static_cast<float>(s.pixel.x()), landmark.level),
                           vision::to_level(static_cast<float>(s.pixel.y()), landmark.level), SE3());
  }
  // Landmarks that are too near or behind the camera are not measured any more; the next note() drops them.
  const auto passed = [](const Landmark& landmark) { return landmark.point.z() < kPassed; };
  std::erase_if(sightings, [&](const Sighting& s) { return passed(landmarks_[s.landmark]); });
  for (Landmark& landmark : landmarks_)
    if (passed(landmark)) landmark.missed = kMaxMissed;
}

void LocalLandmarks::replenish(const Pair& pair, const std::vector<std::vector<vision::Corner>>& corners,
                               std::span<const vision::PicturePoint> avoid, int wanted, double sigma, double offset,
                               std::vector<Sighting>& sightings) {
  std::vector<TakenPoint> taken;
  for (const Sighting& s : sightings)
    taken.push_back({{static_cast<float>(s.pixel.x()), static_cast<float>(s.pixel.y())}, landmarks_[s.landmark].level});
  for (NewLandmark& made : start_landmarks(pair, corners, camera_, taken, avoid, wanted, sigma, offset)) {
    sightings.push_back({static_cast<std::uint32_t>(landmarks_.size()), made.pixel});
    landmarks_.push_back(std::move(made.landmark));
  }
}

std::vector<TrackMeasurement> LocalLandmarks::track_measurements(std::uint32_t sequence,
                                                                 std::span<const Sighting> sightings) {
  std::vector<TrackMeasurement> tracks;
  for (const Sighting& s : sightings) {
    if (tracks.size() >= kMaxTracks) break;
    Landmark& landmark = landmarks_[s.landmark];
    if (!landmark.track) landmark.track = TrackId{sequence, static_cast<std::uint32_t>(tracks.size())};
    const bool right = !is_mono(s.pixel) && s.pixel.z() <= s.pixel.x() && s.pixel.z() >= 0;
    tracks.push_back({*landmark.track, static_cast<float>(s.pixel.x()), static_cast<float>(s.pixel.y()),
                      static_cast<float>(right ? s.pixel.z() : kNoRight), static_cast<std::uint8_t>(landmark.level)});
  }
  return tracks;
}

}  // namespace relmap::tracking
