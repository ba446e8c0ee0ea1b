#include "server/map/edge_choice.h"

#include "server/map/suspicion.h"
#include "storage/format/digest_codec.h"

namespace relmap::map {

double listed_suspicion(const storage::Edge& edge) {
  if (edge.kind != storage::EdgeKind::kLoop) return 0;
  storage::FrameDigest frame;
  frame.slot = storage::slot_of(edge.id.frame);
  frame.closures.push_back(storage::digest_of(edge));
  return suspicion_value(storage::as_stored(edge.id.frame, frame).closures.front());
}

bool EdgeChoice::has(const storage::Edge& edge, std::int64_t time_us) const {
  return filter.matches(edge) && has_time(time_us) && is_near(edge.a, edge.b) &&
         (min_suspicion <= 0 || (edge.kind == storage::EdgeKind::kLoop && listed_suspicion(edge) >= min_suspicion));
}

bool EdgeChoice::has(const storage::ClosureDigest& closure, std::int64_t time_us, double suspicion) const {
  return (filter.states.empty() || filter.states.contains(closure.state)) &&
         (filter.kinds.empty() || filter.kinds.contains(closure.kind)) && filter.joins(closure.a, closure.id.frame) &&
         has_time(time_us) && is_near(closure.a, closure.id.frame) &&
         (min_suspicion <= 0 || (closure.kind == storage::EdgeKind::kLoop && suspicion >= min_suspicion));
}

bool EdgeChoice::may_have_motion(FrameId to, std::int64_t time_us) const {
  const auto may = [](const auto& chosen, auto value) { return chosen.empty() || chosen.contains(value); };
  return min_suspicion <= 0 && has_time(time_us) && may(filter.states, storage::EdgeState::kAccepted) &&
         (may(filter.kinds, storage::EdgeKind::kOdometry) || may(filter.kinds, storage::EdgeKind::kPrior)) &&
         (!filter.session || *filter.session == to.session) &&
         (!filter.other_session || *filter.other_session == to.session);
}

}  // namespace relmap::map
