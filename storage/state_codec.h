// Sessions and the map's state as sealed records.
#pragma once

#include "proto/bytes.h"
#include "proto/status.h"
#include "storage/frame.h"
#include "storage/map.h"

namespace relmap {

Bytes encode_session(const Session& session);
Bytes encode_state(const MapState& state);

// CORRUPT, TRUNCATED or UNKNOWN_FORMAT_VERSION.
Result<Session> decode_session(ByteSpan bytes);
Result<MapState> decode_state(ByteSpan bytes);

// Part of the session and journal records.
void put_header(ByteWriter& w, const SessionHeader& header);
SessionHeader get_header(ByteReader& r);

}  // namespace relmap
