#include "storage/maintenance/digest_check.h"

#include <algorithm>

#include "storage/format/digest_codec.h"
#include "storage/format/keys.h"

namespace relmap::storage {
namespace {

std::string digests_named(ChunkId id) { return "digests of chunk " + id.to_string() + ": "; }

}  // namespace

DigestCheck::DigestCheck(const EngineSnapshot& snapshot, const std::optional<MapState>& state, OnFinding find)
    : snapshot_(snapshot),
      right_(state && state->digests_commit != 0 && state->digests_commit == snapshot.commit_number()),
      find_(std::move(find)) {}

void DigestCheck::check(const StoredPart<FrameHot>& part) const {
  if (!right_ || part.present() == 0) return;
  const FrameId first = frame_in(part.id, static_cast<std::uint32_t>(__builtin_ctzll(part.present())));
  const auto lost = [&](const std::string& what) {
    find_({Reason::DATA_LOSS, first, digests_named(part.id) + what, false});
  };
  const auto record = snapshot_.get(keys::digests(part.id));
  if (!record.ok()) return lost(record.status().to_string());
  if (!*record) return lost("missing");
  ChunkDigest stored;
  if (const Status read = decode_digests(**record, part.id, stored); !read.ok()) return lost(read.to_string());
  std::uint64_t damaged = 0;
  for (const PartDamage& damage : part.damage) damaged |= damage.slots ? damage.slots : ~std::uint64_t{0};
  for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot) {
    if ((damaged >> slot) & 1) continue;
    const auto at = std::find_if(stored.frames.begin(), stored.frames.end(),
                                 [&](const FrameDigest& frame) { return frame.slot == slot; });
    const auto& frame = part.frames[slot];
    const bool there = frame && frame->present;
    const FrameId id = frame_in(part.id, slot);
    if (there ? at != stored.frames.end() && agree(*at, as_stored(id, digest_of(id, *frame)))
              : at == stored.frames.end())
      continue;
    find_({Reason::CORRUPT, id, "digest of frame " + id.to_string() + ": it does not follow from the frame", false});
  }
}

void DigestCheck::check_others(const ChunkTable& chunks) const {
  if (!right_) return;
  const Status scanned = snapshot_.scan(keys::all_digests(), [&](std::string_view key, ByteSpan) {
    const auto id = keys::digests_of(key);
    if (!id) {
      find_({Reason::CORRUPT, {}, "digests: a key that names no chunk", false});
      return true;
    }
    const auto at = std::lower_bound(chunks.entries().begin(), chunks.entries().end(), *id,
                                     [](const ChunkEntry& entry, ChunkId chunk) { return entry.id < chunk; });
    if (at == chunks.entries().end() || at->id != *id)
      find_({Reason::CORRUPT, frame_in(*id, 0), digests_named(*id) + "there is no such chunk", false});
    return true;
  });
  if (!scanned.ok()) find_({Reason::DATA_LOSS, {}, "digests: " + scanned.to_string(), false});
}

std::uint64_t check_digests(const EngineSnapshot& snapshot, const OnFinding& find, const OnProgress& on_progress) {
  const StoredSessions stored = load_sessions(snapshot);
  std::uint64_t found = 0, done = 0;
  const DigestCheck check(snapshot, stored.state, [&](const Finding& finding) {
    ++found;
    if (find) find(finding);
  });
  ChunkTable chunks;
  for (const Session& session : stored.sessions)
    for_each_part<FrameHot>(snapshot, session.number, {chunk_of({0, session.first}), chunk_of({0, session.last})},
                            [&](const StoredPart<FrameHot>& part) {
                              check.check(part);
                              chunks.add(part.id, part.present());
                              if (on_progress && !on_progress({"digests", ++done, 0, "chunks"}))
                                throw StatusError(Status(Reason::SHUTTING_DOWN, "stopped; it can be run again"));
                              return true;
                            });
  check.check_others(chunks);
  return found;
}

}  // namespace relmap::storage
