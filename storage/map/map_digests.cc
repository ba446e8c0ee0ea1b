// Digests made anew for a whole map, in commits of their own.
#include <set>

#include "storage/format/keys.h"
#include "storage/format/state_codec.h"
#include "storage/map/digest_records.h"
#include "storage/map/map_impl.h"
#include "storage/map/part_loader.h"

namespace relmap::storage {
namespace {

constexpr std::size_t kBatchBytes = std::size_t{1} << 20;

std::set<ChunkId> chunks_with_digests(const EngineSnapshot& snapshot) {
  std::set<ChunkId> chunks;
  throw_if(snapshot.scan(keys::all_digests(), [&](std::string_view key, ByteSpan) {
    if (const auto id = keys::digests_of(key)) chunks.insert(*id);
    return true;
  }));
  return chunks;
}

}  // namespace

Status Map::Impl::rebuild_digests(const DigestProgress& progress) try {
  if (const auto before = finish_commit(); before && !before->ok()) return *before;
  const std::shared_ptr<const EngineSnapshot> source = snapshot;
  const auto stored = source->get(keys::map_state()).or_throw();
  MapState committed;
  if (stored) committed = decode_state(*stored).or_throw();
  std::uint64_t number = source->commit_number(), done = 0;
  std::vector<Put> puts;
  std::vector<std::string> deletes;
  std::size_t bytes = 0;
  // `right_as_of`: 0 while they are being made.
  const auto commit = [&](std::uint64_t right_as_of) {
    committed.digests_commit = right_as_of;
    puts.push_back({keys::map_state(), encode_state(committed)});
    throw_if(engine->commit(epoch, engine->applied_sequence(), puts, deletes));
    puts.clear();
    deletes.clear();
    bytes = 0;
    ++number;
    snapshot = engine->snapshot();
    recent_hot.clear();
    recent_warm.clear();
    cache->committed(number, {}, {}, {});
  };
  digests_hold = false;
  std::set<ChunkId> stale = chunks_with_digests(*source);
  scan_hot_parts(*source, {}, budget, [&](const PackedPart<FrameHot>& part) {
    const HotFrames frames = readable_frames(part);
    if (auto record = digest_record(part.id(), {}, frames)) {
      stale.erase(part.id());
      bytes += record->size();
      puts.push_back({keys::digests(part.id()), *std::move(record)});
    }
    for (const auto& frame : frames) done += frame != nullptr;
    if (bytes < kBatchBytes) return true;
    commit(0);
    if (progress && !progress(done, committed.keyframes))
      throw StatusError(Status(Reason::SHUTTING_DOWN, "the digests are made anew in part; it can be done again"));
    return true;
  });
  for (const ChunkId id : stale) deletes.push_back(keys::digests(id));
  commit(number + 1);
  digests_hold = true;
  show();
  return {};
} catch (const StatusError& error) {
  show();  // of the last commit that succeeded
  return error.status();
}

}  // namespace relmap::storage
