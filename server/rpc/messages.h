// Converts values of the map, of its paths and of its edits to relmap.v1 messages. Internal to server/rpc, since it
// exposes generated code.
#pragma once

#include <vector>

#include "proto/wire/convert.h"
#include "relmap/v1/map.pb.h"
#include "relmap/v1/status.pb.h"
#include "server/map/edge_changes.h"
#include "server/route/stretches.h"
#include "storage/graph/graph.h"

namespace relmap::rpc {

// `time_us` is that of the edge's newer end; the second reads it.
v1::Edge edge_message(const storage::Edge& edge, std::int64_t time_us);
v1::Edge edge_message(const storage::Graph& graph, const storage::Edge& edge);
// Who did something, as events and histories tell it: the author of its record, or "relmapd" if no caller did it.
std::string author_name(const std::string& author);
v1::Session session_message(const storage::Session& session);
v1::CarriedStretch carried_message(const route::CarriedStretch& stretch);
v1::EditEffect effect_message(const std::vector<map::EdgeChange>& changes);

// The functions of proto/wire/convert.h, which those below would hide.
using relmap::from_wire;
using relmap::to_wire;
v1::EdgeKind to_wire(storage::EdgeKind kind);
v1::EdgeState to_wire(storage::EdgeState state);
v1::Verification to_wire(storage::Verification verification);
// INVALID_ARGUMENT for an unknown number.
Result<storage::EdgeState> from_wire(v1::EdgeState state);
Result<storage::EdgeKind> from_wire(v1::EdgeKind kind);

// Writes the unmeasured stretches of a path into a reply. `Message` is a RouteSummary or a TransformBetweenReply.
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

void add_count(google::protobuf::RepeatedPtrField<v1::ReasonCount>& counts, Reason reason, std::uint64_t count);

struct FrameParts {
  bool landmarks = false, observations = false, appearance = false, thumbnail = false, picture = false;
};
// NO_SUCH_FRAME.
Result<v1::Frame> frame_message(const storage::Graph& graph, FrameId id, const FrameParts& parts);

// The id of a frame that a request must name: INVALID_ARGUMENT if it is absent, NO_SUCH_FRAME if the map does not hold
// it. `what` names the field in messages.
Result<FrameId> existing_frame(const storage::Graph& graph, bool given, const v1::FrameId& id, const char* what);

}  // namespace relmap::rpc
