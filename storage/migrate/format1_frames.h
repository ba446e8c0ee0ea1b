// Frames as map format 1 (relmap 0.1.0) wrote them: fields in their full width, in tables. Read only to be migrated.
#pragma once

#include <optional>
#include <vector>

#include "proto/base/bytes.h"
#include "storage/graph/frame.h"

namespace relmap::storage::format1 {

inline constexpr std::uint16_t kPartVersion = 1;

// nullopt if the bytes are not such a body.
std::optional<FrameHot> decode_hot(ByteSpan body);
std::optional<FrameWarm> decode_warm(ByteSpan body);
std::optional<FrameCold> decode_cold(ByteSpan body);  // without the words
std::optional<std::vector<std::uint32_t>> decode_words(ByteSpan body);

}  // namespace relmap::storage::format1
