// What stands in a snapshot under the keys of one part of a session, read past whatever is damaged. Where the loader of
// the map stops (storage/map/part_loader.h), this goes on, frame by frame, and names what it could not read.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "storage/engine/engine.h"
#include "storage/graph/chunk.h"

namespace relmap::storage {

// A record that cannot be read, whole or in part.
struct PartDamage {
  Part part = Part::kHot;
  std::string key;
  ChunkId chunk;
  std::uint64_t slots = 0;  // bit by slot: the frames lost with it; 0: it is not known which
  std::string what;         // "hot part of frame 3:120: CORRUPT: ..."
};

// One part of one chunk. Damaged records are in `damage`, and their frames null.
template <typename Frame>
struct StoredPart {
  ChunkId id;
  Slots<Frame> frames;
  std::vector<PartDamage> damage;
  std::vector<std::string> keys;  // where it is stored: the key of the chunk, or those of its frames
  std::size_t bytes = 0;          // in memory

  std::uint64_t present() const {  // bit by slot
    std::uint64_t bits = 0;
    for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot) bits |= std::uint64_t{frames[slot] != nullptr} << slot;
    return bits;
  }
};

using FrameWords = std::vector<std::uint32_t>;
template <>
inline constexpr Part kPartOf<FrameWords> = Part::kWords;

// The chunks in which a session can have frames. Where the keys themselves cannot be read, these are tried one by one.
struct ChunkSpan {
  std::uint32_t first = 0, last = 0;
};

// Visits every record of a part of a session in the order of the keys, with its value or the reason why there is none,
// until `visit` returns false. Returns false if it did.
using VisitRecord = std::function<bool(std::string_view key, ByteSpan value, const Status& status)>;
bool for_each_record(const EngineSnapshot& snapshot, Part part, SessionNumber session, ChunkSpan span,
                     const VisitRecord& visit);

// Visits every chunk of a session that has something of this part, ascending, until `visit` returns false. Damage of
// which not even the chunk is known is reported with the chunks of `span`. Returns false if `visit` stopped it.
template <typename Frame>
bool for_each_part(const EngineSnapshot& snapshot, SessionNumber session, ChunkSpan span,
                   const std::function<bool(StoredPart<Frame>)>& visit);

template <typename Frame>
StoredPart<Frame> load_part(const EngineSnapshot& snapshot, ChunkId id);

// Whether a session is seen to have any key of this part.
bool has_parts(const EngineSnapshot& snapshot, Part part, SessionNumber session);

}  // namespace relmap::storage
