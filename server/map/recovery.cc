#include "server/map/recovery.h"

#include <algorithm>
#include <exception>
#include <map>
#include <string>

#include "storage/journal/journal_record.h"

namespace relmap::map {

Replayed replay(const storage::Engine& engine, std::uint64_t from, MapBuilder& builder) {
  Replayed replayed;
  try {
    const Status read = engine.read_journal(from, [&](std::uint64_t sequence, ByteSpan bytes) {
      auto decoded = storage::decode_record(bytes);
      if (!decoded.ok()) {
        replayed.trouble =
            Status(Reason::DATA_LOSS, "journal record " + std::to_string(sequence) + ": " + decoded.status().message());
        return false;
      }
      const Applied result = builder.apply(sequence, decoded->record);
      if (result.frame) replayed.frames.push_back(*result.frame);
      replayed.looked_up = !result.frame;
      return true;
    });
    if (replayed.trouble.ok()) replayed.trouble = read;
  } catch (const std::exception&) {
    replayed.trouble = caught_status();
  }
  return replayed;
}

void find_open_lookups(const storage::Graph& graph, const std::set<FrameId>& known, const Replayed& replayed,
                       bool deterministic, LookupQueue& lookups) {
  if (deterministic) {  // every lookup was done before the next keyframe was taken in
    for (const FrameId frame : known) lookups.open(frame);
    if (!replayed.frames.empty() && !replayed.looked_up) lookups.open(replayed.frames.back());
    return;
  }
  std::map<storage::TakenIn, FrameId> open;
  const auto add = [&](FrameId frame) {
    if (const auto hot = graph.hot(frame)) open.emplace(storage::taken_in(*hot), frame);
  };
  std::for_each(known.begin(), known.end(), add);
  std::for_each(replayed.frames.begin(), replayed.frames.end(), add);
  for (const auto& [_, frame] : open) lookups.push(frame);
}

}  // namespace relmap::map
