// Digests made anew for a whole map, in commits of their own.
#include <algorithm>
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

Status Map::Impl::make_digests(const DigestProgress& progress, bool go_on) try {
  if (const auto before = finish_commit(); before && !before->ok()) return *before;
  const std::shared_ptr<const EngineSnapshot> source = snapshot;
  const auto stored = source->get(keys::map_state()).or_throw();
  MapState committed;
  if (stored) committed = decode_state(*stored).or_throw();
  std::uint64_t number = source->commit_number();
  DigestsMade made = committed.digests_made;
  if (!go_on || made.commit != number) made = {};
  std::vector<Put> puts;
  std::vector<std::string> deletes;
  std::size_t bytes = 0;
  const auto commit = [&](bool all) {
    ++number;
    made.commit = number;
    committed.digests_commit = all ? number : 0;
    committed.digests_made = all ? DigestsMade() : made;
    puts.push_back({keys::map_state(), encode_state(committed)});
    throw_if(engine->commit(epoch, engine->applied_sequence(), puts, deletes));
    puts.clear();
    deletes.clear();
    bytes = 0;
    snapshot = engine->snapshot();
    recent_hot.clear();
    recent_warm.clear();
    cache->committed(number, {}, {}, {});
  };
  digests_hold = false;
  std::set<ChunkId> stale = chunks_with_digests(*source);  // those of chunks that are gone, once the others are made
  const auto delete_stale = [&](std::set<ChunkId>::iterator end) {
    std::for_each(stale.begin(), end, [&](ChunkId id) { deletes.push_back(keys::digests(id)); });
    stale.erase(stale.begin(), end);
  };
  ChunkId from;
  if (made.commit != 0) {
    stale.erase(stale.begin(), stale.upper_bound(made.through));
    from = {made.through.session, made.through.chunk + 1};
  }
  scan_hot_parts(*source, from, budget, [&](const PackedPart<FrameHot>& part) {
    const HotFrames frames = readable_frames(part);
    delete_stale(stale.lower_bound(part.id()));
    if (auto record = digest_record(part.id(), {}, frames)) {
      stale.erase(part.id());
      bytes += record->size();
      puts.push_back({keys::digests(part.id()), *std::move(record)});
    }
    made.through = part.id();
    for (const auto& frame : frames) made.frames += frame != nullptr;
    const bool stopped = progress && !progress(made.frames, committed.keyframes);
    delete_stale(stale.upper_bound(part.id()));  // one without a frame that can be read
    if (bytes >= kBatchBytes || stopped) commit(false);
    if (stopped)
      throw StatusError(Status(Reason::SHUTTING_DOWN, "the digests are made anew in part; the rest can be made later"));
    return true;
  });
  delete_stale(stale.end());
  commit(true);
  digests_hold = true;
  show();
  return {};
} catch (const StatusError& error) {
  show();  // of the last commit that succeeded
  return error.status();
}

}  // namespace relmap::storage
