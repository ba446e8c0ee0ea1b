// Writes the unmeasured stretches of a path into a reply. Internal to server/rpc, since it exposes generated code.
#pragma once

#include "proto/wire/convert.h"
#include "relmap/v1/map.pb.h"
#include "server/route/stretches.h"

namespace relmap::rpc {

// `Message` is a RouteSummary or a TransformBetweenReply.
template <typename Message>
void tell_unmeasured(const route::UnmeasuredStretches& stretches, Message& message) {
  for (const route::UnmeasuredStretch& stretch : stretches.list()) {
    v1::UnmeasuredStretch& told = *message.add_unmeasured();
    *told.mutable_first() = to_wire(stretch.first);
    *told.mutable_last() = to_wire(stretch.last);
    told.set_steps(stretch.steps);
    told.set_distance_m(stretch.distance_m);
  }
  message.set_unmeasured_steps(stretches.steps());
  message.set_unmeasured_m(stretches.distance_m());
}

}  // namespace relmap::rpc
