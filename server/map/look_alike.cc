#include "server/map/look_alike.h"

#include <algorithm>
#include <optional>

#include "server/map/closures.h"
#include "server/map/consistency.h"
#include "server/map/stops.h"
#include "server/place/place_neighbours.h"
#include "storage/graph/frame_range.h"

namespace relmap::map {

namespace {

constexpr std::uint32_t kMaxSteps = 300;     // length of a stretch in each direction
constexpr std::uint32_t kMinCompared = 150;  // parts of pictures: those of about five pictures
constexpr std::uint32_t kMinChanged = 4;
constexpr std::size_t kMaxOthers = 8;  // other stretches that are examined
constexpr double kAnother = 0.02;      // above this share of changed parts, it is a place that looks alike
constexpr double kTheSame = 0.015;     // up to this share, it is the same place

// The frame after the last stop before `frame`, or where motion begins; nullopt if neither is found back to `earliest`.
std::optional<std::uint32_t> alighted(const storage::Graph& graph, FrameId frame, std::uint32_t earliest) {
  Standing standing;
  std::uint32_t moving = frame.index;  // going back, the last frame that the robot did not stand before
  for (FrameId at = frame; at.index > earliest;) {
    const auto hot = graph.hot(at);
    const storage::Edge* motion = hot ? motion_to(*hot) : nullptr;
    if (!motion) return at.index;
    if (!standing.is_standing()) moving = at.index;
    if (standing.is_stop(*motion)) return moving;
    at = motion->a;
  }
  return std::nullopt;
}

// The last frame before the first stop after `frame`, or where motion ends; at most `latest`.
std::uint32_t boards(const storage::Graph& graph, FrameId frame, std::uint32_t latest) {
  Standing standing;
  std::uint32_t moving = frame.index;  // the last frame that the robot did not stand after
  for (FrameId at = frame; at.index < latest;) {
    const auto next = place::next_of(graph, at);
    const auto hot = next ? graph.hot(*next) : nullptr;
    const storage::Edge* motion = hot ? motion_to(*hot) : nullptr;
    if (!motion) return at.index;
    if (!standing.is_standing()) moving = at.index;
    if (standing.is_stop(*motion)) return moving;
    at = *next;
  }
  return latest;
}

storage::FrameRange stretch_round(const storage::Graph& graph, FrameId frame) {
  const std::uint32_t earliest = frame.index - std::min(frame.index, kMaxSteps);
  return {frame.session, alighted(graph, frame, earliest).value_or(earliest),
          boards(graph, frame, frame.index + kMaxSteps)};
}

// Whether the closure says that two stretches of its session are the same place. Closures that were outvoted, or are
// ambiguous, do not.
bool says_same(const storage::Edge& edge) {
  const bool believed =
      edge.state == storage::EdgeState::kAccepted || edge.reason == Reason::LONE || edge.reason == Reason::LOOKS_ALIKE;
  return edge.kind == storage::EdgeKind::kLoop && edge.a.session == edge.b.session && believed &&
         edge.state != storage::EdgeState::kRemoved && edge.verification != storage::Verification::kCompounded &&
         !contradicts_odometry(edge);
}

// Calls `visit` with each says_same() closure of the queries in a stretch.
template <typename Visit>
void visit_closures(const storage::Graph& graph, const storage::FrameRange& queries, const Visit& visit) {
  for (std::uint32_t index = queries.first; index <= queries.last; ++index) {
    const auto hot = graph.hot({queries.session, index});
    if (!hot) continue;
    for (const storage::Edge& edge : hot->edges)
      if (says_same(edge)) visit(edge);
  }
}

SameStretch between(const storage::Graph& graph, const storage::FrameRange& now, const storage::FrameRange& then) {
  SameStretch same;
  visit_closures(graph, now, [&](const storage::Edge& edge) {
    if (!then.contains(edge.a)) return;
    same.decided = same.decided || is_decided(edge);
    same.closures.push_back(edge.id);
    same.compared += edge.uniqueness.compared;
    same.changed += edge.uniqueness.changed;
  });
  return same;
}

// Whether a closure between the two stretches is refused as a look-alike.
bool are_told_apart(const storage::Graph& graph, const storage::FrameRange& a, const storage::FrameRange& b) {
  bool refused = false;
  visit_closures(graph, a.first > b.first ? a : b, [&](const storage::Edge& edge) {
    refused = refused || (edge.reason == Reason::LOOKS_ALIKE && (a.first > b.first ? b : a).contains(edge.a));
  });
  return refused;
}

}  // namespace

bool SameStretch::is_compared() const { return compared >= kMinCompared; }

bool SameStretch::is_another() const {
  return !decided && is_compared() && changed >= kMinChanged && change() > kAnother;
}

bool SameStretch::is_the_same() const { return decided || changed < kMinChanged || change() <= kTheSame; }

bool is_rather(const SameStretch& one, const SameStretch& other) {
  if (one.decided != other.decided) return one.decided;
  if (one.decided || !one.is_compared()) return false;
  return !other.is_compared() || one.change() < other.change();
}

LookAlikes weigh_look_alikes(const storage::Graph& graph, const storage::Edge& closure) {
  const FrameId match = closure.a, query = closure.b;
  if (match.session != query.session || match.index >= query.index || query.index - match.index > kMotionReach)
    return {};
  if (!alighted(graph, query, match.index)) return {};
  const storage::FrameRange now = stretch_round(graph, query), then = stretch_round(graph, match);
  LookAlikes found;
  found.place = between(graph, now, then);
  std::vector<storage::FrameRange> others;
  visit_closures(graph, now, [&](const storage::Edge& edge) {
    const bool far = edge.a.index + kMotionReach < query.index || others.size() == kMaxOthers;
    if (edge.state != storage::EdgeState::kAccepted || far || then.contains(edge.a) || now.contains(edge.a) ||
        storage::within(edge.a, others))
      return;
    others.push_back(stretch_round(graph, edge.a));
  });
  for (const storage::FrameRange& other : others)
    if (are_told_apart(graph, other, then)) found.instead.push_back(between(graph, now, other));
  return found;
}

}  // namespace relmap::map
