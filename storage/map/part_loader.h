// Reads parts from a snapshot, without a cache. All functions throw StatusError (IO_ERROR, DATA_LOSS naming the part).
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "storage/engine/engine.h"
#include "storage/format/packed_part.h"

namespace relmap::storage {

template <typename Frame>  // FrameHot or FrameWarm
struct LoadedPart {
  std::shared_ptr<const PackedPart<Frame>> part;
  std::uint64_t commit = 0;  // the last that wrote to it; 0 if there is no such chunk
};
// The part of a closed chunk, or of an open one, gathered from its frames.
template <typename Frame>
LoadedPart<Frame> load_packed(const EngineSnapshot& snapshot, ChunkId id, std::shared_ptr<Budget> budget);

extern template LoadedPart<FrameHot> load_packed(const EngineSnapshot&, ChunkId, std::shared_ptr<Budget>);
extern template LoadedPart<FrameWarm> load_packed(const EngineSnapshot&, ChunkId, std::shared_ptr<Budget>);

// Visits the hot parts of all chunks from `from` on, ascending, until `visit` returns false. What of them is damaged is
// found when it is asked for.
void scan_hot_parts(const EngineSnapshot& snapshot, ChunkId from, const std::shared_ptr<Budget>& budget,
                    const std::function<bool(const PackedPart<FrameHot>&)>& visit);

struct LoadedCold {
  std::shared_ptr<const FrameCold> frame;  // null: no such frame, or one that sent neither features nor picture
  std::uint64_t commit = 0;
};
LoadedCold load_cold(const EngineSnapshot& snapshot, FrameId id);

// The words of a frame's record.
std::vector<std::uint32_t> decode_words_record(ByteSpan record, FrameId id);

}  // namespace relmap::storage
