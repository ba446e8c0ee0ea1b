#include "storage/graph/observers.h"

#include <algorithm>
#include <iterator>
#include <unordered_set>
#include <utility>

#include "storage/graph/binding.h"

namespace relmap::storage {

namespace {

// Frames from which a step up leads to `id`.
std::vector<FrameId> frames_one_above(const Graph& graph, FrameId id, const FrameHot& hot) {
  std::vector<FrameId> found;
  const Edge* motion = hot.edge({id, 0});
  if (motion && motion->in_graph() && graph.hot(motion->a)) found.push_back(motion->a);
  for (const EdgeId incoming : hot.incoming) {
    const auto other = graph.hot(incoming.frame);
    const Edge* edge = other ? other->edge(incoming) : nullptr;
    if (edge && edge->in_graph() && edge->a == id) found.push_back(incoming.frame);
  }
  return found;
}

}  // namespace

bool in_one_pass(FrameId a, FrameId b) {
  return a.session == b.session && (a.index > b.index ? a.index - b.index : b.index - a.index) <= kPassFrames;
}

bool is_fixed(const std::vector<FrameId>& observers) {
  if (observers.size() >= kMaxObservers) return true;
  std::size_t passes = 0;
  for (auto at = observers.begin(); at != observers.end() && passes <= kMaxPasses; ++at) {
    const auto before = std::make_reverse_iterator(at);
    passes += std::none_of(before, observers.rend(), [&](FrameId earlier) { return in_one_pass(*at, earlier); });
  }
  return passes > kMaxPasses;
}

std::vector<LandmarkId> landmarks_seen(const Graph& graph, const FrameWarm& frame,
                                       std::vector<LandmarkId>* not_needed) {
  const auto sort_unique = [](std::vector<LandmarkId>& landmarks) {
    std::sort(landmarks.begin(), landmarks.end());
    landmarks.erase(std::unique(landmarks.begin(), landmarks.end()), landmarks.end());
  };
  std::vector<LandmarkId> seen;
  seen.reserve(frame.observations.size());
  if (not_needed) not_needed->clear();
  for (const Observation& z : frame.observations) {
    if (!closure_holds(graph, z.origin)) continue;
    const Meaning meaning = meaning_of(graph, z.landmark);
    if (!meaning.landmark.valid()) continue;
    if (meaning.needed)
      seen.push_back(meaning.landmark);
    else if (not_needed)
      not_needed->push_back(meaning.landmark);
  }
  sort_unique(seen);
  if (not_needed) sort_unique(*not_needed);
  return seen;
}

void keep_first_observers(const Graph& graph, std::vector<FrameId>* frames) {
  std::vector<std::pair<TakenIn, FrameId>> ordered;
  ordered.reserve(frames->size());
  for (const FrameId frame : *frames)
    if (const auto hot = graph.hot(frame)) ordered.emplace_back(taken_in(*hot), frame);
  std::sort(ordered.begin(), ordered.end());
  ordered.erase(std::unique(ordered.begin(), ordered.end()), ordered.end());
  frames->clear();
  for (std::size_t k = 0; k < ordered.size() && !is_fixed(*frames); ++k) frames->push_back(ordered[k].second);
}

std::vector<FrameId> frames_above(const Graph& graph, const std::vector<FrameId>& frames, std::uint32_t depth) {
  std::vector<FrameId> found;
  std::unordered_set<FrameId> known;
  for (const FrameId frame : frames)
    if (graph.hot(frame) && known.insert(frame).second) found.push_back(frame);
  std::size_t begin = 0;
  for (std::uint32_t step = 0; step < depth && begin < found.size(); ++step) {
    const std::size_t end = found.size();
    for (; begin < end; ++begin)
      for (const FrameId above : frames_one_above(graph, found[begin], *graph.hot(found[begin])))
        if (known.insert(above).second) found.push_back(above);
  }
  return found;
}

std::vector<FrameId> frames_in_reach(const Graph& graph, FrameId base) {
  LocalGraph local(graph);
  std::vector<std::int32_t> walk;
  local.nearest(local.frame(base), kWalkFrames, &walk);
  std::vector<FrameId> frames;
  for (const std::int32_t frame : walk) frames.push_back(local.frames[frame].id);
  return frames_above(graph, frames, kWalkDepth);
}

const std::vector<LandmarkId>& FirstObservers::seen_from(FrameId frame) {
  constexpr std::size_t kMaxKept = 4096;
  if (seen_.size() >= kMaxKept) seen_.clear();
  const auto [found, fresh] = seen_.try_emplace(frame);
  if (fresh) found->second = landmarks_seen(graph_, *graph_.warm(frame));
  return found->second;
}

std::vector<FrameId> FirstObservers::of(LandmarkId landmark) {
  constexpr std::size_t kMaxFrames = 8192;
  if (landmark.base != base_) {
    base_ = landmark.base;
    in_reach_ = frames_in_reach(graph_, base_);
    if (local_.frames.size() > kMaxFrames) local_.clear();
  }
  std::vector<FrameId> list;
  for (const FrameId frame : in_reach_) {
    const std::vector<LandmarkId>& seen = seen_from(frame);
    if (std::binary_search(seen.begin(), seen.end(), landmark) &&
        local_.path(local_.frame(base_), local_.frame(frame), &path_))
      list.push_back(frame);
  }
  keep_first_observers(graph_, &list);
  return list;
}

}  // namespace relmap::storage
