#include "storage/map/digest_records.h"

#include <algorithm>

#include "storage/format/keys.h"
#include "storage/map/part_loader.h"

namespace relmap::storage {
namespace {

std::int64_t first_time(const HotFrames& frames) {
  for (const auto& frame : frames)
    if (frame && frame->present) return frame->time_us;
  return 0;
}

bool any_entry(const PackedDigests& digests) {
  return std::any_of(digests.entries.begin(), digests.entries.end(), [](ByteSpan entry) { return !entry.empty(); });
}

// The committed digests of a chunk, with what is dirty of it, to be visited.
class Merge {
 public:
  Merge(const DirtyTable& dirty, ChunkId from, DigestsOf which, const std::function<bool(const ChunkDigest&)>& visit)
      : which_(which),
        next_(std::lower_bound(dirty.begin(), dirty.end(), from,
                               [](const auto& entry, const ChunkId& key) { return entry.first < key; })),
        end_(dirty.end()),
        visit_(visit) {}

  // `digests` are the committed ones; chunks must ascend. Returns false if the visit is to end.
  bool take(ChunkDigest& digests) {
    if (!before(digests.id)) return false;
    if (next_ != end_ && next_->first == digests.id) overlay(digests, *(next_++)->second);
    return give(digests);
  }
  void finish() { (void)before(std::nullopt); }

 private:
  // Visits the chunks before `id` that are dirty and not committed.
  bool before(std::optional<ChunkId> id) {
    for (; next_ != end_ && (!id || next_->first < *id); ++next_) {
      ChunkDigest digests{next_->first, {}};
      overlay(digests, *next_->second);
      if (!give(digests)) return false;
    }
    return true;
  }
  void overlay(ChunkDigest& digests, const DirtyChunk& dirty) const {
    if (dirty.removed) digests.frames.clear();
    replace_digests(digests, dirty.hot, which_);
  }
  bool give(const ChunkDigest& digests) { return going_ = going_ && (digests.frames.empty() || visit_(digests)); }

  const DigestsOf which_;
  DirtyTable::const_iterator next_, end_;
  const std::function<bool(const ChunkDigest&)>& visit_;
  bool going_ = true;
};

}  // namespace

std::optional<Bytes> digest_record(ChunkId id, const PackedDigests& before, const HotFrames& edited) {
  const bool fresh = !any_entry(before);
  DigestWriter writer(id, fresh ? first_time(edited) : before.time_us);
  for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot) {
    if (edited[slot]) {
      if (edited[slot]->present) writer.add(digest_of(frame_in(id, slot), *edited[slot]));
    } else if (!before.entries[slot].empty()) {
      writer.copy(slot, before.entries[slot], before.has_closures(slot));
    }
  }
  if (writer.empty()) return std::nullopt;
  return writer.finish();
}

HotFrames readable_frames(const PackedPart<FrameHot>& part) {
  HotFrames frames;
  for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot) try {
      frames[slot] = part.frame(slot);
    } catch (const StatusError& error) {
      if (error.status().reason() != Reason::DATA_LOSS) throw;
    }
  return frames;
}

void replace_digests(ChunkDigest& digests, const HotFrames& edited, DigestsOf which) {
  for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot) {
    if (!edited[slot]) continue;
    const auto at = std::lower_bound(digests.frames.begin(), digests.frames.end(), slot,
                                     [](const FrameDigest& frame, std::uint32_t s) { return frame.slot < s; });
    const bool there = at != digests.frames.end() && at->slot == slot;
    const FrameId id = frame_in(digests.id, slot);
    FrameDigest digest = digest_of(id, *edited[slot]);
    if (!edited[slot]->present || (which == DigestsOf::kClosures && digest.closures.empty())) {
      if (there) digests.frames.erase(at);
      continue;
    }
    digest = as_stored(id, digest);
    if (there)
      *at = std::move(digest);
    else
      digests.frames.insert(at, std::move(digest));
  }
}

void visit_digests(const EngineSnapshot& snapshot, bool recorded, const std::shared_ptr<Budget>& budget,
                   const DirtyTable& dirty, ChunkId from, DigestsOf which,
                   const std::function<bool(const ChunkDigest&)>& visit) {
  Merge merge(dirty, from, which, visit);
  ChunkDigest digests;
  if (recorded) {
    throw_if(snapshot.scan_from(keys::all_digests(), keys::digests(from), [&](std::string_view key, ByteSpan record) {
      const auto id = keys::digests_of(key);
      if (!id) return true;
      if (const Status decoded = decode_digests(record, *id, digests, which); !decoded.ok())
        throw StatusError(Status(Reason::DATA_LOSS, "digests of chunk " + id->to_string() + ": " + decoded.to_string() +
                                                        "; relmap-admin repair makes them anew"));
      return merge.take(digests);
    }));
  } else {
    scan_hot_parts(snapshot, from, budget, [&](const PackedPart<FrameHot>& part) {
      digests.id = part.id();
      digests.frames.clear();
      replace_digests(digests, readable_frames(part), which);
      return merge.take(digests);
    });
  }
  merge.finish();
}

}  // namespace relmap::storage
