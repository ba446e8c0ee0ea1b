// Sessions and the map's state as map format 1 (relmap 0.1.0) wrote them: skipped sequences stood in the record of
// their session, frames that wait for relaxation in the map's state. Read only to be migrated.
#pragma once

#include <vector>

#include "proto/base/bytes.h"
#include "proto/base/status.h"
#include "storage/map/map.h"

namespace relmap::storage::format1 {

struct SessionRecord {
  Session session;  // refused and given_up counted
  std::vector<Skipped> skipped;
};
// CORRUPT, TRUNCATED or UNKNOWN_FORMAT_VERSION.
Result<SessionRecord> decode_session(ByteSpan bytes);
Result<MapState> decode_state(ByteSpan bytes);  // with `pending`

}  // namespace relmap::storage::format1
