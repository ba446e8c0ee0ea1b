// The keys under which the map stands in an engine (docs/storage-format.md). Numbers are big-endian, so that keys sort
// as the identities do.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "storage/graph/chunk.h"

namespace relmap::storage::keys {

// Sizes of the keys of a session, of a part of a closed chunk, and of a part of a frame.
inline constexpr std::size_t kSessionKey = 5, kChunkKey = 9, kFrameKey = 10;

// Whether this version knows keys that begin with `first`. Keys of a later version begin with another byte; they are
// kept as they are, and readers ignore them.
bool is_known(char first);

std::string map_state();

std::string session(SessionNumber number);
std::string_view all_sessions();
std::optional<SessionNumber> session_of(std::string_view key);  // nullopt: not a session's key

// Skipped sequences of a session, by the last one of the range.
std::string skipped(SessionNumber session, std::uint32_t to);
std::string skipped_in(SessionNumber session);  // prefix
std::string_view all_skipped();
// Frames of a chunk that wait for relaxation.
std::string pending(ChunkId id);
std::string_view all_pending();
std::optional<ChunkId> pending_of(std::string_view key);

// The digests of a chunk.
std::string digests(ChunkId id);
std::string_view all_digests();
std::optional<ChunkId> digests_of(std::string_view key);

// The name of an edit, by the edit's sequence in the journal.
std::string edit(std::uint64_t sequence);
std::string_view all_edits();
std::optional<std::uint64_t> edit_of(std::string_view key);

// A block of the log of events (storage/events), by the position of its last event; and the log's head.
std::string events(std::uint64_t sequence, std::uint32_t ordinal);
std::string_view all_events();  // prefix of all these, and the key of the head
struct EventKey {
  std::uint64_t sequence = 0;
  std::uint32_t ordinal = 0;
};
std::optional<EventKey> events_of(std::string_view key);  // nullopt: not a block's key

// A closed chunk's part; while the chunk is open, the prefix of its frames' records.
std::string part(Part part, ChunkId id);
// A frame's record: while its chunk is open (hot, warm), or for good (cold, words).
std::string frame(Part part, FrameId id);
std::optional<FrameId> frame_of(std::string_view key);  // nullopt: not a frame's record
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
