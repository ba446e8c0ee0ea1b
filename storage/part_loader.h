// Reads and decodes parts from a snapshot; no cache. All throw StatusError (IO_ERROR, DATA_LOSS naming the part).
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "storage/chunk.h"
#include "storage/engine.h"

namespace relmap {

template <typename Frame>
struct LoadedPart {
  Slots<Frame> frames;
  std::uint64_t commit = 0;  // the last that wrote to it
  std::size_t bytes = 0;     // in memory
};
// A closed chunk's part, or an open chunk's frames gathered.
LoadedPart<FrameHot> load_hot(const EngineSnapshot& snapshot, ChunkId id);
LoadedPart<FrameWarm> load_warm(const EngineSnapshot& snapshot, ChunkId id);

struct LoadedCold {
  std::shared_ptr<const FrameCold> frame;  // null: no such frame
  std::uint64_t commit = 0;
};
LoadedCold load_cold(const EngineSnapshot& snapshot, FrameId id);

// The words of a frame's record.
std::vector<std::uint32_t> decode_words_record(ByteSpan record, FrameId id);

}  // namespace relmap
