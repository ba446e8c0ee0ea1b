// What stands in a snapshot under the keys of one part of a session, read past whatever is damaged: where the loader of
// the map stops (storage/part_loader.h), this goes on, frame by frame, and names what it could not read.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "storage/chunk.h"
#include "storage/engine.h"

namespace relmap {

// A record that cannot be read, whole or in part.
struct PartDamage {
  Part part = Part::kHot;
  std::string key;
  ChunkId chunk;
  std::uint64_t slots = 0;  // bit by slot: the frames lost with it; 0: it cannot be told which
  std::string what;         // "hot part of frame 3:120: CORRUPT: ..."
};

// One part of one chunk. Damaged records are in `damage`, and their frames null.
template <typename Frame>
struct StoredPart {
  ChunkId id;
  Slots<Frame> frames;
  std::vector<PartDamage> damage;
  std::size_t bytes = 0;  // in memory
};

using FrameWords = std::vector<std::uint32_t>;
template <>
inline constexpr Part kPartOf<FrameWords> = Part::kWords;

// Chunks in which a session can have frames: where the keys themselves cannot be read, these are tried one by one.
struct ChunkSpan {
  std::uint32_t first = 0, last = 0;
};

// Every chunk of a session that has something of this part, ascending, until `visit` returns false. What was damaged so
// that not even its chunk is known is told with the chunks of `span`. False if `visit` stopped it.
template <typename Frame>
bool for_each_part(const EngineSnapshot& snapshot, SessionNumber session, ChunkSpan span,
                   const std::function<bool(StoredPart<Frame>)>& visit);

template <typename Frame>
StoredPart<Frame> load_part(const EngineSnapshot& snapshot, ChunkId id);

// The lowest session above `after` that has keys of this part; 0: there is none.
SessionNumber next_session_with(const EngineSnapshot& snapshot, Part part, SessionNumber after);

}  // namespace relmap
