#include "storage/binding.h"

#include <algorithm>

namespace relmap {

bool closure_holds(const Graph& graph, ClosureId closure) {
  if (!closure.valid()) return true;
  const auto hot = graph.hot(closure.frame);
  const Edge* edge = hot ? hot->edge(closure) : nullptr;
  return edge && edge->state == EdgeState::kAccepted;
}

LandmarkId resolve(const Graph& graph, LandmarkId landmark) {
  for (;;) {
    const auto hot = graph.hot(landmark.base);
    if (!hot || landmark.slot >= hot->landmarks.size()) return landmark;
    const auto& claims = hot->landmarks[landmark.slot].claims;
    const auto holding = std::find_if(claims.begin(), claims.end(),
                                      [&](const AliasClaim& claim) { return closure_holds(graph, claim.closure); });
    if (holding == claims.end()) return landmark;
    landmark = holding->target;  // older than its claimant, so this ends
  }
}

}  // namespace relmap
