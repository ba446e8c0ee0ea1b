#include "server/place/place_neighbours.h"

#include <unordered_map>
#include <unordered_set>

namespace relmap::place {
namespace {

// A robot that drops more keyframes in a row than this has moved on to another place.
constexpr std::uint32_t kMaxMissing = 3;

}  // namespace

bool is_mono_session(const storage::Graph& graph, SessionNumber session) {
  const auto known = graph.session(session);
  return known && !known->header.camera.is_stereo();
}

std::optional<FrameId> previous_of(const storage::Graph& graph, FrameId frame) {
  for (std::uint32_t step = 1; step <= kMaxMissing + 1 && step <= frame.index; ++step)
    if (const FrameId previous{frame.session, frame.index - step}; graph.hot(previous)) return previous;
  return std::nullopt;
}

std::optional<FrameId> next_of(const storage::Graph& graph, FrameId frame) {
  for (std::uint32_t step = 1; step <= kMaxMissing + 1; ++step)
    if (const FrameId next{frame.session, frame.index + step}; next.index > frame.index && graph.hot(next)) return next;
  return std::nullopt;
}

namespace {

constexpr std::size_t kMaxNeighbours = 1000;

// `is_free(frame, hot, step)` tells whether a step, in either direction, does not count.
template <typename IsFree>
std::vector<FrameId> neighbours_within(const storage::Graph& graph, FrameId centre, std::uint32_t radius,
                                       const IsFree& is_free) {
  std::unordered_map<SessionNumber, bool> mono;
  const auto is_mono = [&](SessionNumber number) {
    const auto [entry, fresh] = mono.try_emplace(number, false);
    if (fresh) entry->second = is_mono_session(graph, number);
    return entry->second;
  };

  std::vector<FrameId> found{centre}, next;  // `next` is one step further away than the end of `found`
  std::unordered_set<FrameId> seen{centre};
  std::size_t begin = 0;
  for (std::uint32_t depth = 0;; ++depth) {
    for (; begin < found.size(); ++begin) {
      const FrameId frame = found[begin];
      const auto hot = graph.hot(frame);
      if (!hot) continue;
      const auto add = [&](FrameId step, bool free) {
        if (free ? seen.insert(step).second : depth < radius && !seen.contains(step))
          (free ? found : next).push_back(step);
      };
      for (const storage::Neighbour& n : storage::neighbours(graph, frame, *hot)) add(n.frame, is_free(frame, *hot, n));
      if (is_mono(frame.session))
        for (const auto& step : {previous_of(graph, frame), next_of(graph, frame)})
          if (step) add(*step, false);
      if (seen.size() >= kMaxNeighbours) break;
    }
    const bool ends = next.empty() || seen.size() >= kMaxNeighbours;
    for (const FrameId step : next)
      if (seen.insert(step).second) found.push_back(step);
    if (ends) return found;
    next.clear();
  }
}

}  // namespace

std::vector<FrameId> place_neighbours(const storage::Graph& graph, FrameId centre, std::uint32_t radius) {
  return neighbours_within(graph, centre, radius,
                           [](FrameId, const storage::FrameHot&, const storage::Neighbour&) { return false; });
}

std::vector<FrameId> place_neighbours_driven(const storage::Graph& graph, FrameId centre, std::uint32_t radius) {
  const auto stands = [](const storage::FrameHot& hot, EdgeId step) {
    const storage::Edge* edge = hot.edge(step);
    return edge && edge->kind != storage::EdgeKind::kLoop && storage::stood(*edge);
  };
  return neighbours_within(graph, centre, radius,
                           [&](FrameId frame, const storage::FrameHot& hot, const storage::Neighbour& step) {
                             if (step.edge.ordinal != 0) return false;
                             if (step.edge.frame == frame) return stands(hot, step.edge);
                             const auto other = graph.hot(step.edge.frame);
                             return other && stands(*other, step.edge);
                           });
}

}  // namespace relmap::place
