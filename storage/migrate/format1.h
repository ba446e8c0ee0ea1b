// What map format 1 (relmap 0.1.0) wrote: frames with fields in their full width, in tables; skipped sequences in the
// record of their session; frames that wait for relaxation in the map's state. Read only to be migrated.
#pragma once

#include <optional>
#include <vector>

#include "proto/base/bytes.h"
#include "proto/base/status.h"
#include "storage/graph/frame.h"
#include "storage/map/map.h"

namespace relmap::storage::format1 {

inline constexpr std::uint16_t kPartVersion = 1;

// nullopt if the bytes are not such a body.
std::optional<FrameHot> decode_hot(ByteSpan body);
std::optional<FrameWarm> decode_warm(ByteSpan body);
std::optional<FrameCold> decode_cold(ByteSpan body);  // without the words
std::optional<std::vector<std::uint32_t>> decode_words(ByteSpan body);

struct SessionRecord {
  Session session;  // refused and given_up counted
  std::vector<Skipped> skipped;
};
// CORRUPT, TRUNCATED or UNKNOWN_FORMAT_VERSION.
Result<SessionRecord> decode_session(ByteSpan bytes);
Result<MapState> decode_state(ByteSpan bytes);  // with `pending`

}  // namespace relmap::storage::format1
