#include "server/rba/local_map.h"

#include <algorithm>

#include "storage/binding.h"

namespace relmap::rba {

namespace {

constexpr std::size_t kMostAtEachEnd = 16;  // of a landmark's observers: RbaOptions::max_observations_per_landmark

}  // namespace

void LocalMap::clear() {
  frames.clear();
  edges.clear();
  landmarks.clear();
  observations.clear();
  index_.clear();
  last_ = {{}, -1};
  edge_at_.clear();
  landmark_at_.clear();
  steps_.clear();
  visited_.clear();
  wanted_.clear();
  visit_ = 0;
}

std::int32_t LocalMap::frame(FrameId id) {
  if (id == last_.first) return last_.second;  // observations come base by base
  if (const std::int32_t* known = index_.find(id)) {
    last_ = {id, *known};
    return *known;
  }
  auto hot = graph_.hot(id);
  std::int32_t index = -1;
  if (hot != nullptr && hot->present) {
    index = static_cast<std::int32_t>(frames.size());
    LocalFrame& added = frames.emplace_back();
    added.id = id;
    added.first_edge = static_cast<std::int32_t>(edge_at_.size());
    added.first_landmark = static_cast<std::int32_t>(landmark_at_.size());
    edge_at_.resize(edge_at_.size() + hot->edges.size(), -1);
    landmark_at_.resize(landmark_at_.size() + hot->landmarks.size(), -1);
    added.hot = std::move(hot);
    visited_.push_back(0);
    wanted_.push_back(0);
  }
  index_.insert(id, index);
  return index;
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

std::int32_t LocalMap::edge(std::int32_t owner, std::size_t position) {
  const std::size_t at = static_cast<std::size_t>(frames[owner].first_edge) + position;
  if (edge_at_[at] >= 0) return edge_at_[at];
  const Edge& record = frames[owner].hot->edges[position];
  LocalEdge added;
  added.id = record.id;
  added.T_ab = record.T_ab;
  added.covariance = record.covariance;
  added.record = &record;
  added.b = owner;
  added.a = frame(record.a);
  const auto index = static_cast<std::int32_t>(edges.size());
  edge_at_[at] = index;
  edges.push_back(added);
  return index;
}

std::span<const LocalStep> LocalMap::steps(std::int32_t of) {
  if (frames[of].first_step < 0) {
    const FrameHot& hot = *frames[of].hot;
    const auto first = static_cast<std::int32_t>(steps_.size());
    for (std::size_t k = 0; k < hot.edges.size(); ++k) {
      if (!hot.edges[k].in_graph()) continue;
      const std::int32_t e = edge(of, k);
      if (edges[e].a >= 0) steps_.push_back({e, edges[e].a, false});
    }
    for (const EdgeId incoming : hot.incoming) {
      const std::int32_t other = frame(incoming.frame);
      if (other < 0) continue;
      const FrameHot& newer = *frames[other].hot;
      for (std::size_t k = 0; k < newer.edges.size(); ++k)
        if (newer.edges[k].id == incoming && newer.edges[k].in_graph()) steps_.push_back({edge(other, k), other, true});
    }
    std::sort(steps_.begin() + first, steps_.end(),
              [&](const LocalStep& l, const LocalStep& r) { return edges[l.edge].id < edges[r.edge].id; });
    frames[of].first_step = first;
    frames[of].end_step = static_cast<std::int32_t>(steps_.size());
  }
  return {steps_.data() + frames[of].first_step, steps_.data() + frames[of].end_step};
}

bool LocalMap::holds(ClosureId closure) {
  if (!closure.valid()) return true;
  const std::int32_t owner = frame(closure.frame);
  const Edge* record = owner < 0 ? nullptr : frames[owner].hot->edge(closure);
  return record != nullptr && record->state == EdgeState::kAccepted;
}

// resolve() of storage/binding.h, on what is loaded.
LandmarkId LocalMap::in_force(LandmarkId id) {
  for (;;) {
    const std::int32_t base = frame(id.base);
    if (base < 0 || id.slot >= frames[base].hot->landmarks.size()) return id;
    const auto& claims = frames[base].hot->landmarks[id.slot].claims;
    std::size_t k = 0;
    while (k < claims.size()) {
      const AliasClaim claim = claims[k];
      if (holds(claim.closure)) break;
      ++k;
    }
    if (k == claims.size()) return id;
    id = claims[k].target;
  }
}

std::int32_t LocalMap::landmark(LandmarkId stored) {
  const std::int32_t owner = frame(stored.base);
  if (owner < 0 || stored.slot >= frames[owner].hot->landmarks.size()) return -1;
  const auto at = static_cast<std::size_t>(frames[owner].first_landmark) + stored.slot;
  if (landmark_at_[at] >= 0) return landmark_at_[at];
  const LandmarkId id = in_force(stored);
  const std::int32_t base = frame(id.base);
  if (base < 0 || id.slot >= frames[base].hot->landmarks.size()) return -1;
  std::int32_t& index = landmark_at_[static_cast<std::size_t>(frames[base].first_landmark) + id.slot];
  if (index < 0) {
    index = static_cast<std::int32_t>(landmarks.size());
    const Landmark& record = frames[base].hot->landmarks[id.slot];
    landmarks.push_back({id, base, record.abr, record.depth_prior, false, false, &record});
  }
  landmark_at_[at] = index;
  return index;
}

void LocalMap::load_observations(std::int32_t of) {
  if (frames[of].first_observation >= 0) return;
  const auto warm = graph_.warm(frames[of].id);
  const auto first = static_cast<std::int32_t>(observations.size());
  if (frames[of].camera < 0) frames[of].camera = camera(frames[of].id.session);
  if (warm != nullptr) {
    for (const Observation& record : warm->observations) {
      if (!holds(record.origin)) continue;
      const std::int32_t point = landmark(record.landmark);
      if (point < 0) continue;
      const double sigma = pixel_sigma(record.level);
      const StereoPixel z = record.pixel();
      const bool mono = is_mono(z) || !cameras[frames[of].camera].is_stereo();
      observations.push_back({of, point, z, 1 / (sigma * sigma), mono});
    }
  }
  frames[of].warm = warm;
  frames[of].first_observation = first;
  frames[of].end_observation = static_cast<std::int32_t>(observations.size());
}

void LocalMap::load_observers(std::int32_t point) {
  if (landmarks[point].observers_loaded) return;
  landmarks[point].observers_loaded = true;
  const std::vector<FrameId>& observers = landmarks[point].record->observers;
  for (std::size_t k = 0; k < observers.size(); ++k) {
    if (k >= kMostAtEachEnd && k + kMostAtEachEnd < observers.size()) continue;
    const std::int32_t observer = frame(observers[k]);
    if (observer >= 0) load_observations(observer);
  }
}

void LocalMap::nearest(std::int32_t root, std::uint32_t count, std::vector<std::int32_t>* found) {
  ++visit_;
  visited_[root] = visit_;
  const std::size_t first = found->size(), end = first + count;
  found->push_back(root);
  for (std::size_t next = first; next < found->size() && found->size() < end; ++next)
    for (const LocalStep step : steps((*found)[next])) {
      if (visited_[step.frame] == visit_ || found->size() >= end) continue;
      visited_[step.frame] = visit_;
      found->push_back(step.frame);
    }
}

void LocalMap::path_tree(std::int32_t root, std::span<const std::int32_t> targets, std::vector<TreeNode>* nodes) {
  ++visit_;
  std::size_t missing = 0;
  for (const std::int32_t target : targets) {
    if (target == root || wanted_[target] == visit_) continue;
    wanted_[target] = visit_;
    ++missing;
  }
  search_.clear();
  search_.push_back({root, -1, -1, false, 0});
  visited_[root] = visit_;
  bool cut = false;
  for (std::size_t next = 0; next < search_.size() && missing > 0 && !cut; ++next) {
    const TreeNode node = search_[next];
    for (const LocalStep step : steps(node.frame)) {
      if (visited_[step.frame] == visit_) continue;
      if (node.depth == kPathDepth || search_.size() == kPathFrames) {
        cut = true;
        break;
      }
      visited_[step.frame] = visit_;
      search_.push_back({step.frame, static_cast<std::int32_t>(next), step.edge, step.forward, node.depth + 1});
      if (wanted_[step.frame] == visit_ && --missing == 0) break;
    }
  }
  // Cut to what leads to a target: from the back, so that a needed child marks its parent before that is looked at.
  renumbered_.assign(search_.size(), -1);
  renumbered_[0] = 0;
  for (std::size_t n = search_.size(); n-- > 1;)
    if (renumbered_[n] == 0 || wanted_[search_[n].frame] == visit_) {
      renumbered_[n] = 0;
      renumbered_[search_[n].parent] = 0;
    }
  std::int32_t kept = 0;
  for (std::size_t n = 0; n < search_.size(); ++n) {
    if (renumbered_[n] < 0) continue;
    renumbered_[n] = kept++;
    nodes->push_back(search_[n]);
    if (n > 0) nodes->back().parent = renumbered_[search_[n].parent];
  }
}

}  // namespace relmap::rba
