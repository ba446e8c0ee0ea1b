#include "server/rba/local_map.h"

#include <algorithm>

#include "storage/graph/binding.h"
#include "storage/graph/observers.h"

namespace relmap::rba {

namespace {

constexpr std::size_t kMaxCameras = 64;  // kept from one relaxation to the next

// Standard deviation of a bound observation over that of a tracked one. A track that was bound to an older landmark by
// its descriptor started at a corner of its own, about a pixel away, and stays there; a keypoint without a track is
// about two pixels away.
constexpr double kClaimedSigma = 3, kUntrackedSigma = 8;

// `in_force` is the landmark in force that the observation stands for.
double sigma_of(const storage::Observation& observation, LandmarkId in_force) {
  const double sigma = pixel_sigma(observation.level);
  if (!observation.is_tracked() && !observation.aligned) return kUntrackedSigma * sigma;
  return observation.landmark == in_force ? sigma : kClaimedSigma * sigma;
}

}  // namespace

void LocalMap::clear() {
  storage::LocalGraph::clear();
  if (cameras.size() > kMaxCameras) {
    cameras.clear();
    camera_of_session_.clear();
  }
  estimates.clear();
  landmarks.clear();
  observations.clear();
  views_.clear();
  frame_fixed_.clear();
  first_landmark_.clear();
  landmark_at_.clear();
}

EdgeEstimate& LocalMap::estimate(std::int32_t edge) {
  for (std::size_t e = estimates.size(); e <= static_cast<std::size_t>(edge); ++e) {
    EdgeEstimate& added = estimates.emplace_back();
    added.T_ab = edges[e].record->T_ab;
    added.covariance = edges[e].record->covariance;
  }
  return estimates[edge];
}

const LocalView& LocalMap::view(std::int32_t frame) {
  if (views_.size() < frames.size()) views_.resize(frames.size());
  return views_[frame];
}

std::int32_t& LocalMap::landmark_at(std::int32_t frame, std::uint32_t slot) {
  for (std::size_t f = first_landmark_.size(); f <= static_cast<std::size_t>(frame); ++f) {
    first_landmark_.push_back(static_cast<std::int32_t>(landmark_at_.size()));
    landmark_at_.resize(landmark_at_.size() + frames[f].hot->landmarks.size(), -1);
  }
  return landmark_at_[static_cast<std::size_t>(first_landmark_[frame]) + slot];
}

std::int32_t LocalMap::camera(SessionNumber session) {
  for (const auto& [number, index] : camera_of_session_)
    if (number == session) return index;
  const auto record = graph_.session(session);
  const auto index = static_cast<std::int32_t>(cameras.size());
  cameras.push_back(record ? record->header.camera : StereoCamera());
  camera_of_session_.emplace_back(session, index);
  return index;
}

bool LocalMap::holds(ClosureId closure) {
  if (!closure.valid()) return true;
  const std::int32_t owner = frame(closure.frame);
  const storage::Edge* record = owner < 0 ? nullptr : frames[owner].hot->edge(closure);
  return record != nullptr && record->state == storage::EdgeState::kAccepted;
}

// resolve() of storage/graph/binding.h, on what is loaded.
LandmarkId LocalMap::in_force(LandmarkId id) {
  while (id.valid()) {
    const std::int32_t base = frame(id.base);
    if (base < 0 || id.slot >= frames[base].hot->landmarks.size()) return id;
    const auto& claims = frames[base].hot->landmarks[id.slot].claims;
    std::size_t k = 0;
    while (k < claims.size()) {
      const storage::AliasClaim claim = claims[k];
      if (holds(claim.closure) && (!claim.target.valid() || frame(claim.target.base) >= 0)) break;
      ++k;
    }
    if (k == claims.size()) return id;
    id = claims[k].target;
  }
  return id;
}

std::int32_t LocalMap::landmark(LandmarkId stored) {
  const std::int32_t owner = frame(stored.base);
  if (owner < 0 || stored.slot >= frames[owner].hot->landmarks.size()) return -1;
  if (const std::int32_t known = landmark_at(owner, stored.slot); known >= 0) return known;
  const LandmarkId id = in_force(stored);
  const std::int32_t base = id.valid() ? frame(id.base) : -1;
  if (base < 0 || id.slot >= frames[base].hot->landmarks.size()) return -1;
  std::int32_t index = landmark_at(base, id.slot);
  if (index < 0) {
    index = landmark_at(base, id.slot) = static_cast<std::int32_t>(landmarks.size());
    const storage::Landmark& record = frames[base].hot->landmarks[id.slot];
    landmarks.push_back({id, base, record.abr, record.depth_prior, false, false, storage::is_fixed(record.observers),
                         is_frozen(base), &record});
  }
  landmark_at(owner, stored.slot) = index;
  return index;
}

void LocalMap::load_observations(std::int32_t of) {
  if (view(of).first >= 0) return;
  LocalView loaded;
  loaded.first = static_cast<std::int32_t>(observations.size());
  loaded.camera = camera(frames[of].id.session);
  if (const auto warm = graph_.warm(frames[of].id)) {
    for (const storage::Observation& record : warm->observations) {
      if (!holds(record.origin)) continue;
      const std::int32_t point = landmark(record.landmark);
      if (point < 0) continue;
      const double sigma = sigma_of(record, landmarks[point].id);
      const StereoPixel z = record.pixel();
      const bool mono = is_mono(z) || !cameras[loaded.camera].is_stereo();
      observations.push_back({of, point, z, 1 / (sigma * sigma), mono});
    }
  }
  loaded.end = static_cast<std::int32_t>(observations.size());
  views_[of] = loaded;
}

void LocalMap::load_observers(std::int32_t point) {
  if (landmarks[point].observers_loaded) return;
  landmarks[point].observers_loaded = true;
  for (const FrameId id : landmarks[point].record->observers)
    if (const std::int32_t observer = frame(id); observer >= 0) load_observations(observer);
}

bool LocalMap::frame_is_fixed(std::int32_t of) {
  if (frame_fixed_.size() < frames.size()) frame_fixed_.resize(frames.size(), -1);
  if (frame_fixed_[of] >= 0) return frame_fixed_[of] != 0;
  std::uint32_t measured = 0;
  if (const auto warm = graph_.warm(frames[of].id))
    for (const storage::Observation& record : warm->observations) {
      if (measured == storage::kMinSupport) break;
      const std::int32_t point = holds(record.origin) ? landmark(record.landmark) : -1;
      if (point < 0 || !landmarks[point].fixed) continue;
      const auto& list = landmarks[point].record->observers;
      measured += std::find(list.begin(), list.end(), frames[of].id) != list.end();
    }
  frame_fixed_.resize(frames.size(), -1);
  frame_fixed_[of] = static_cast<std::int8_t>(measured == storage::kMinSupport);
  return frame_fixed_[of] != 0;
}

}  // namespace relmap::rba
