// Enums of a daemon's reply. Internal to client/, since it exposes generated code.
#pragma once

#include "client/map_types.h"
#include "relmap/v1/common.pb.h"
#include "relmap/v1/graph.pb.h"

namespace relmap::client {

// CORRUPT, with `value` as it was: what the daemon says has no meaning here.
Status read_enum(v1::EdgeKind wire, EdgeKind& value);
Status read_enum(v1::EdgeState wire, EdgeState& value);
Status read_enum(v1::Verification wire, Verification& value);
Status read_enum(v1::MotionSource wire, MotionSource& value);
Status read_enum(v1::SessionState wire, SessionState& value);
Status read_enum(v1::DoubtKind wire, DoubtKind& value);

}  // namespace relmap::client
