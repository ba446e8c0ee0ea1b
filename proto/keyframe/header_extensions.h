// What of a session's header stands in its extensions (docs/storage-format.md, Extensions), wherever the header is
// written: in keyframes, in the map, in the journal and in a robot's spool.
#pragma once

#include "proto/keyframe/keyframe.h"

namespace relmap {

// Those that this version knows, joined to the unknown ones.
Extensions header_extensions(const SessionHeader& header);
// Takes those that this version knows out of `all` and leaves the rest in header.unknown. False: malformed.
bool set_header_extensions(SessionHeader& header, Extensions all);

}  // namespace relmap
