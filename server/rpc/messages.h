// Converts stored values to relmap.v1 messages. Internal to server/rpc, since it exposes generated code.
#pragma once

#include "proto/wire/convert.h"
#include "relmap/v1/map.pb.h"
#include "storage/graph/graph.h"

namespace relmap::rpc {

v1::Edge edge_message(const storage::Edge& edge);
v1::Session session_message(const storage::Session& session);

// The functions of proto/wire/convert.h, which those below would hide.
using relmap::from_wire;
using relmap::to_wire;
v1::EdgeKind to_wire(storage::EdgeKind kind);
v1::EdgeState to_wire(storage::EdgeState state);
v1::Verification to_wire(storage::Verification verification);
// INVALID_ARGUMENT for an unknown number.
Result<storage::EdgeState> from_wire(v1::EdgeState state);
Result<storage::EdgeKind> from_wire(v1::EdgeKind kind);

struct FrameParts {
  bool landmarks = false, observations = false, appearance = false, thumbnail = false;
};
// NO_SUCH_FRAME.
Result<v1::Frame> frame_message(const storage::Graph& graph, FrameId id, const FrameParts& parts);

// The id of a frame that a request must name: INVALID_ARGUMENT if it is absent, NO_SUCH_FRAME if the map does not hold
// it. `what` names the field in messages.
Result<FrameId> existing_frame(const storage::Graph& graph, bool given, const v1::FrameId& id, const char* what);

}  // namespace relmap::rpc
