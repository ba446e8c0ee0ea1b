// The keys under which the map stands in an engine (docs/storage-format.md). Numbers are big-endian, so that keys sort
// as the identities do.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "storage/graph/chunk.h"

namespace relmap::storage::keys {

// Whether this version knows what begins so. Keys of a later version begin with another byte; they are kept as they
// are, and ignored by all that reads.
bool is_known(char first);

std::string map_state();

std::string session(SessionNumber number);
std::string_view all_sessions();

// Sequences of a session that ended without a frame, by the last of them.
std::string settled(SessionNumber session, std::uint32_t to);
std::string settled_in(SessionNumber session);  // prefix
std::string_view all_settled();
// Frames of a chunk that wait for relaxation.
std::string pending(ChunkId id);
std::string_view all_pending();
std::optional<ChunkId> pending_of(std::string_view key);

// A closed chunk's part; the prefix of its frames' records while it is open.
std::string part(Part part, ChunkId id);
// A frame's record: of an open chunk (hot, warm), or for good (cold, words).
std::string frame(Part part, FrameId id);
std::optional<FrameId> frame_of(std::string_view key);  // of a frame's record
// What a key of a part stands for.
struct PartKey {
  Part part;
  ChunkId chunk;
  std::optional<std::uint32_t> slot;  // of a frame's record
};
std::optional<PartKey> part_of(std::string_view key);

// The index of labels.
std::string label(std::string_view label, FrameId id);
std::string labelled(std::string_view label);           // prefix: the frames of one label
std::string labels_beginning(std::string_view prefix);  // prefix: all labels that begin so
struct LabelKey {
  std::string label;
  FrameId frame;
};
std::optional<LabelKey> label_of(std::string_view key);

}  // namespace relmap::storage::keys
