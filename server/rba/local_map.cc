#include "server/rba/local_map.h"

#include <algorithm>

#include "storage/binding.h"

namespace relmap::rba {

namespace {

constexpr std::size_t kMostAtEachEnd = 16;  // of a landmark's observers: RbaOptions::max_observations_per_landmark

}  // namespace

std::int32_t LocalMap::frame(FrameId id) {
  if (id == last_.first) return last_.second;  // observations come base by base
  const auto known = index_.find(id);
  if (known != index_.end()) {
    last_ = *known;
    return known->second;
  }
  auto hot = graph_.hot(id);
  std::int32_t index = -1;
  if (hot != nullptr && hot->present) {
    index = static_cast<std::int32_t>(frames.size());
    LocalFrame& added = frames.emplace_back();
    added.id = id;
    added.edges.assign(hot->edges.size(), -1);
    added.landmarks.assign(hot->landmarks.size(), -1);
    added.hot = std::move(hot);
    visited_.push_back(0);
    wanted_.push_back(0);
  }
  index_.emplace(id, index);
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
  if (frames[owner].edges[position] >= 0) return frames[owner].edges[position];
  const Edge& record = frames[owner].hot->edges[position];
  LocalEdge added;
  added.id = record.id;
  added.T_ab = record.T_ab;
  added.covariance = record.covariance;
  added.record = &record;
  added.b = owner;
  added.a = frame(record.a);
  const auto index = static_cast<std::int32_t>(edges.size());
  frames[owner].edges[position] = index;
  edges.push_back(added);
  return index;
}

std::span<const LocalStep> LocalMap::steps(std::int32_t of) {
  if (frames[of].first_step < 0) {
    const auto hot = frames[of].hot;  // kept: frames may move
    const auto first = static_cast<std::int32_t>(steps_.size());
    std::vector<LocalStep> found;
    for (std::size_t k = 0; k < hot->edges.size(); ++k) {
      if (!hot->edges[k].in_graph()) continue;
      const std::int32_t e = edge(of, k);
      if (edges[e].a >= 0) found.push_back({e, edges[e].a, false});
    }
    for (const EdgeId incoming : hot->incoming) {
      const std::int32_t other = frame(incoming.frame);
      if (other < 0) continue;
      const auto& stored = frames[other].hot->edges;
      for (std::size_t k = 0; k < stored.size(); ++k)
        if (stored[k].id == incoming && stored[k].in_graph()) found.push_back({edge(other, k), other, true});
    }
    std::sort(found.begin(), found.end(),
              [&](const LocalStep& l, const LocalStep& r) { return edges[l.edge].id < edges[r.edge].id; });
    steps_.insert(steps_.end(), found.begin(), found.end());
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
  if (owner < 0 || stored.slot >= frames[owner].landmarks.size()) return -1;
  if (frames[owner].landmarks[stored.slot] >= 0) return frames[owner].landmarks[stored.slot];
  const LandmarkId id = in_force(stored);
  const std::int32_t base = frame(id.base);
  if (base < 0 || id.slot >= frames[base].landmarks.size()) return -1;
  std::int32_t index = frames[base].landmarks[id.slot];
  if (index < 0) {
    index = static_cast<std::int32_t>(landmarks.size());
    const Landmark& record = frames[base].hot->landmarks[id.slot];
    landmarks.push_back({id, base, record.abr, record.depth_prior, false, false, &record});
    frames[base].landmarks[id.slot] = index;
  }
  frames[owner].landmarks[stored.slot] = index;
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

std::vector<std::int32_t> LocalMap::nearest(std::int32_t root, std::uint32_t count) {
  std::vector<std::int32_t> found = {root};
  ++visit_;
  visited_[root] = visit_;
  for (std::size_t next = 0; next < found.size() && found.size() < count; ++next)
    for (const LocalStep step : steps(found[next])) {
      if (visited_[step.frame] == visit_ || found.size() >= count) continue;
      visited_[step.frame] = visit_;
      found.push_back(step.frame);
    }
  return found;
}

void LocalMap::path_tree(std::int32_t root, std::span<const std::int32_t> targets, std::vector<TreeNode>* tree) {
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
  tree->clear();
  for (std::size_t n = 0; n < search_.size(); ++n) {
    if (renumbered_[n] < 0) continue;
    renumbered_[n] = static_cast<std::int32_t>(tree->size());
    tree->push_back(search_[n]);
    if (n > 0) tree->back().parent = renumbered_[search_[n].parent];
  }
}

}  // namespace relmap::rba
