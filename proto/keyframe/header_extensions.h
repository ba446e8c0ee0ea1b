// The fields of a session's header that are written as extensions (docs/storage-format.md, Extensions) wherever the
// header is stored: in keyframes, in the map, in the journal and in a robot's spool.
#pragma once

#include "proto/keyframe/keyframe.h"

namespace relmap {

// The extensions of `header`: the fields that this version knows, and header.unknown.
Extensions header_extensions(const SessionHeader& header);
// Sets the fields that this version knows from `all`, and header.unknown to the rest. False: a field is malformed.
bool set_header_extensions(SessionHeader& header, Extensions all);

}  // namespace relmap
