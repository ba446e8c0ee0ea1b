// Sessions, skipped sequences, frames that wait for relaxation, and the map's state as sealed records.
#pragma once

#include "proto/base/bytes.h"
#include "proto/base/status.h"
#include "storage/graph/frame.h"
#include "storage/graph/map_state.h"

namespace relmap::storage {

Bytes encode_session(const Session& session);
Bytes encode_skipped(const Skipped& skipped);
Bytes encode_pending(std::uint64_t frames);  // of one chunk, a bit by slot
Bytes encode_edit(const EditKey& edit);
Bytes encode_state(const MapState& state);  // without `pending`

// CORRUPT, TRUNCATED or UNKNOWN_FORMAT_VERSION.
Result<Session> decode_session(ByteSpan bytes);
Result<Skipped> decode_skipped(ByteSpan bytes);
Result<std::uint64_t> decode_pending(ByteSpan bytes);
Result<EditKey> decode_edit(ByteSpan bytes);
Result<MapState> decode_state(ByteSpan bytes);

// The header as session records and journal records contain it.
void put_header(ByteWriter& w, const SessionHeader& header);
SessionHeader get_header(ByteReader& r);
// The fields with which records of all formats begin (migrate/format1.h): of a session all but `refused` and
// `given_up`; of the state its facts. get_facts() returns false if they are incomplete.
Session get_session(ByteReader& r);
bool get_facts(ByteReader& r, MapFacts& facts);

}  // namespace relmap::storage
