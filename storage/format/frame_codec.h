// One frame's part as bytes: the body of a record in a chunk part (storage/format/chunk_codec.h). The encoding is
// exact: decode(encode(x)) == x, doubles bit for bit. It is compact where estimates have the precision at which they
// are kept (storage/graph/precision.h). The container has the checksums.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "proto/base/bytes.h"
#include "storage/graph/frame.h"

namespace relmap::storage {

// `id` is the frame's own, which is not written; other identities are written relative to it.
void encode_hot(ByteWriter& w, FrameId id, const FrameHot& frame);
void encode_warm(ByteWriter& w, FrameId id, const FrameWarm& frame);
void encode_cold(ByteWriter& w, const FrameCold& frame);  // without the words
void encode_words(ByteWriter& w, const std::vector<std::uint32_t>& words);

// nullopt if the bytes are not such a body.
std::optional<FrameHot> decode_hot(ByteSpan body, FrameId id);
std::optional<FrameWarm> decode_warm(ByteSpan body, FrameId id);
std::optional<FrameCold> decode_cold(ByteSpan body);
std::optional<std::vector<std::uint32_t>> decode_words(ByteSpan body);

}  // namespace relmap::storage
