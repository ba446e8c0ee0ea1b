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

constexpr std::size_t kMaxNeighbours = 1000;

std::vector<FrameId> place_neighbours(const storage::Graph& graph, FrameId centre, std::uint32_t radius) {
  std::unordered_map<SessionNumber, bool> mono;
  const auto is_mono = [&](SessionNumber number) {
    const auto [entry, fresh] = mono.try_emplace(number, false);
    if (fresh) entry->second = is_mono_session(graph, number);
    return entry->second;
  };

  std::vector<FrameId> found{centre};
  std::unordered_set<FrameId> seen{centre};
  std::size_t begin = 0;
  for (std::uint32_t depth = 0; depth < radius; ++depth) {
    const std::size_t end = found.size();
    for (std::size_t i = begin; i < end; ++i) {
      const FrameId frame = found[i];
      const auto hot = graph.hot(frame);
      if (!hot) continue;
      std::vector<FrameId> steps;
      for (const storage::Neighbour& n : storage::neighbours(graph, frame, *hot)) steps.push_back(n.frame);
      if (is_mono(frame.session))
        for (const auto& step : {previous_of(graph, frame), next_of(graph, frame)})
          if (step) steps.push_back(*step);
      for (const FrameId step : steps)
        if (seen.insert(step).second) found.push_back(step);
      if (found.size() >= kMaxNeighbours) return found;
    }
    begin = end;
  }
  return found;
}

}  // namespace relmap::place
