// What is stored, as relmap.v1 messages. Internal to server/rpc: shows generated code.
#pragma once

#include "relmap/v1/map.pb.h"
#include "storage/graph.h"

namespace relmap {

v1::Edge edge_message(const Edge& edge);
v1::Session session_message(const Session& session);

v1::EdgeKind to_wire(EdgeKind kind);
v1::EdgeState to_wire(EdgeState state);
v1::Verification to_wire(Verification verification);
// INVALID_ARGUMENT for a number that is none of ours.
Result<EdgeState> from_wire(v1::EdgeState state);
Result<EdgeKind> from_wire(v1::EdgeKind kind);

struct FrameParts {
  bool landmarks = false, observations = false, appearance = false, thumbnail = false;
};
// NO_SUCH_FRAME.
Result<v1::Frame> frame_message(const Graph& graph, FrameId id, const FrameParts& parts);

// The id of a request that must name a frame: INVALID_ARGUMENT if it is absent, NO_SUCH_FRAME if the map has none.
Result<FrameId> existing_frame(const Graph& graph, bool given, const v1::FrameId& id, const char* what);

}  // namespace relmap
