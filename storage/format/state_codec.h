// Sessions, what they settled without a frame, frames that wait for relaxation, and the map's state as sealed records.
#pragma once

#include "proto/base/bytes.h"
#include "proto/base/status.h"
#include "storage/graph/frame.h"
#include "storage/graph/map_state.h"

namespace relmap::storage {

Bytes encode_session(const Session& session);
Bytes encode_settled(const Settled& settled);
Bytes encode_pending(std::uint64_t frames);  // of one chunk, a bit by slot
Bytes encode_state(const MapState& state);   // without `pending`

// CORRUPT, TRUNCATED or UNKNOWN_FORMAT_VERSION.
Result<Session> decode_session(ByteSpan bytes);
Result<Settled> decode_settled(ByteSpan bytes);
Result<std::uint64_t> decode_pending(ByteSpan bytes);
Result<MapState> decode_state(ByteSpan bytes);

// Part of the session and journal records.
void put_header(ByteWriter& w, const SessionHeader& header);
SessionHeader get_header(ByteReader& r);
// What the records of all formats begin with (migrate/format1_state.h): of a session all but `refused` and `given_up`;
// of the state its facts, false if they are not whole.
Session get_session(ByteReader& r);
bool get_facts(ByteReader& r, MapFacts& facts);

}  // namespace relmap::storage
