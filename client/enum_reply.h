// Enums of a daemon's reply. Internal to client/.
#pragma once

#include "client/map_types.h"

namespace relmap::v1 {
enum DoubtKind : int;
enum EdgeKind : int;
enum EdgeState : int;
enum MotionSource : int;
enum SessionState : int;
enum Verification : int;
}  // namespace relmap::v1

namespace relmap::client {

// CORRUPT, with `value` as it was: what the daemon says has no meaning here. It may be newer than this client, since
// enums grow. Of what decides nothing, callers leave such a value out instead.
Status read_enum(v1::EdgeKind wire, EdgeKind& value);
Status read_enum(v1::EdgeState wire, EdgeState& value);
Status read_enum(v1::Verification wire, Verification& value);
Status read_enum(v1::MotionSource wire, MotionSource& value);
Status read_enum(v1::SessionState wire, SessionState& value);
Status read_enum(v1::DoubtKind wire, DoubtKind& value);

}  // namespace relmap::client
