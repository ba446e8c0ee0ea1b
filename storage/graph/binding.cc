#include "storage/graph/binding.h"

#include <algorithm>

namespace relmap::storage {

bool closure_holds(const Graph& graph, ClosureId closure) {
  if (!closure.valid()) return true;
  const auto hot = graph.hot(closure.frame);
  const Edge* edge = hot ? hot->edge(closure) : nullptr;
  return edge && edge->state == EdgeState::kAccepted;
}

Meaning meaning_of(const Graph& graph, LandmarkId landmark) {
  auto hot = graph.hot(landmark.base);
  for (;;) {
    if (!hot || landmark.slot >= hot->landmarks.size()) return {LandmarkId(), false};
    std::shared_ptr<const FrameHot> target;
    const auto& claims = hot->landmarks[landmark.slot].claims;
    const auto holding = std::find_if(claims.begin(), claims.end(), [&](const AliasClaim& claim) {
      return closure_holds(graph, claim.closure) && (!claim.target.valid() || (target = graph.hot(claim.target.base)));
    });
    if (holding == claims.end()) return {landmark};
    if (!holding->target.valid()) return {landmark, false};
    landmark = holding->target;  // older than its claimant, so this ends
    hot = std::move(target);
  }
}

LandmarkId resolve(const Graph& graph, LandmarkId landmark) {
  const Meaning meaning = meaning_of(graph, landmark);
  return meaning.needed ? meaning.landmark : LandmarkId();
}

}  // namespace relmap::storage
