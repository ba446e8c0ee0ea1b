#include "server/route/passage.h"

namespace relmap::route {

bool Passage::is_oneway(SessionNumber number) {
  const auto [it, fresh] = oneway_.try_emplace(number, false);
  if (fresh) {
    const auto session = graph_.session(number);
    it->second = session && session->header.oneway;
  }
  return it->second;
}

bool Passage::open(FrameId frame) {
  const bool passes = filter_.passes(frame);
  met_filter_ |= !passes;
  return passes;
}

bool Passage::open(const storage::Edge& edge, bool forward) {
  if (!open(forward ? edge.b : edge.a)) return false;
  if (!filter_.passes(edge)) {
    met_filter_ = true;
    return false;
  }
  if (forward || filter_.against_oneway || edge.kind == storage::EdgeKind::kLoop || !is_oneway(edge.id.frame.session))
    return true;
  met_oneway_ = true;
  return false;
}

}  // namespace relmap::route
