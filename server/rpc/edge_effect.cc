#include "server/rpc/edge_effect.h"

#include "proto/wire/convert.h"
#include "server/route/stretches.h"
#include "server/rpc/messages.h"

namespace relmap::rpc {

namespace {

const std::vector<EdgeId>& carriers(const std::optional<map::EdgeStanding>& standing) {
  static const std::vector<EdgeId> kNone;
  return standing ? standing->carried_by : kNone;
}

void fill(const map::EdgeChange& change, v1::ClosureChange& message) {
  *message.mutable_id() = to_wire(change.id);
  *message.mutable_a() = to_wire(change.a);
  *message.mutable_b() = to_wire(change.b);
  if (change.before) {
    message.set_before(to_wire(change.before->state));
    message.set_reason_before(to_wire(change.before->reason));
    message.set_edge_before(change.before->in_graph);
  }
  if (change.after) {
    message.set_after(to_wire(change.after->state));
    message.set_reason_after(to_wire(change.after->reason));
    message.set_edge_after(change.after->in_graph);
  }
  message.set_bound(change.bound);
  message.set_bound_frames(change.bound_frames);
}

}  // namespace

v1::EditEffect effect_message(const std::vector<map::EdgeChange>& changes) {
  v1::EditEffect message;
  route::CarriedStretches carried, not_carried;
  for (const map::EdgeChange& change : changes) {
    if (change.kind == storage::EdgeKind::kLoop) {
      fill(change, *message.add_closures());
      continue;
    }
    const std::vector<EdgeId>&before = carriers(change.before), &after = carriers(change.after);
    if (before.empty()) carried.add(change.a, change.b, after);
    if (after.empty()) not_carried.add(change.a, change.b, before);
  }
  for (const route::CarriedStretch& stretch : carried.list()) *message.add_carried() = carried_message(stretch);
  for (const route::CarriedStretch& stretch : not_carried.list()) *message.add_not_carried() = carried_message(stretch);
  return message;
}

}  // namespace relmap::rpc
