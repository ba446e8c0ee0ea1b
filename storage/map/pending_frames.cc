#include "storage/map/pending_frames.h"

#include "storage/format/keys.h"
#include "storage/format/state_codec.h"

namespace relmap::storage {

Status load_pending(const EngineSnapshot& snapshot, FrameSet& pending,
                    const std::function<void(std::string_view key, const std::string& what)>& damaged) {
  const Status scanned = snapshot.scan(keys::all_pending(), [&](std::string_view key, ByteSpan value) {
    const auto chunk = keys::pending_of(key);
    const auto frames = decode_pending(value);
    if (chunk && frames.ok())
      pending.set_chunk(*chunk, *frames);
    else
      damaged(key, "frames that wait for relaxation" + (chunk ? " in chunk " + chunk->to_string() : std::string()) +
                       ": " + frames.status().to_string());
    return true;
  });
  pending.take_changes();  // it is the same as what is stored
  return scanned;
}

void write_pending(const FrameSet& pending, std::vector<Put>& puts, std::vector<std::string>& deletes) {
  for (const ChunkId id : pending.changed()) {
    if (const std::uint64_t frames = pending.chunk(id); frames != 0)
      puts.push_back({keys::pending(id), encode_pending(frames)});
    else
      deletes.push_back(keys::pending(id));
  }
}

}  // namespace relmap::storage
