// The digests of chunks as a commit writes them and a view reads them (storage/graph/digest.h).
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <optional>

#include "storage/engine/engine.h"
#include "storage/format/digest_codec.h"
#include "storage/format/packed_part.h"
#include "storage/map/dirty_table.h"

namespace relmap::storage {

using HotFrames = std::array<std::shared_ptr<const FrameHot>, kFramesPerChunk>;

// The record with the digests of `edited`, where these are set, in place of those of `before`. nullopt if it has none.
std::optional<Bytes> digest_record(ChunkId id, const PackedDigests& before, const HotFrames& edited);

// The frames of a part that can be read: digests say nothing of the others, which `verify` names.
HotFrames readable_frames(const PackedPart<FrameHot>& part);

// Replaces the digests of the frames that are set in `edited`. Of `kClosures`, frames without any are left out.
void replace_digests(ChunkDigest& digests, const HotFrames& edited, DigestsOf which);

// Visits the digests of all chunks with such frames from `from` on, ascending, until `visit` returns false: those of
// the snapshot with what is dirty on top of it. `recorded`: the snapshot's records are right; otherwise its frames are
// read. Throws StatusError (IO_ERROR; DATA_LOSS naming the chunk whose record is damaged).
void visit_digests(const EngineSnapshot& snapshot, bool recorded, const std::shared_ptr<Budget>& budget,
                   const DirtyTable& dirty, ChunkId from, DigestsOf which,
                   const std::function<bool(const ChunkDigest&)>& visit);

}  // namespace relmap::storage
