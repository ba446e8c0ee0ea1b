#include "storage/format/keys.h"

namespace relmap::storage::keys {
namespace {

char family(Part part) {
  switch (part) {
    case Part::kHot:
      return 'h';
    case Part::kWarm:
      return 'w';
    case Part::kCold:
      return 'c';
    case Part::kWords:
      break;
  }
  return 'v';
}

void put_u32(std::string& key, std::uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) key.push_back(static_cast<char>(value >> shift));
}

std::string chunk_key(std::string_view prefix, ChunkId id) {
  std::string key(prefix);
  put_u32(key, id.session);
  put_u32(key, id.chunk);
  return key;
}

std::uint32_t get_u32(std::string_view bytes) {
  std::uint32_t value = 0;
  for (int i = 0; i < 4; ++i) value = (value << 8) | static_cast<std::uint8_t>(bytes[static_cast<std::size_t>(i)]);
  return value;
}

// Keeps the order of labels, whatever bytes they hold: 00 becomes 00 ff, and the end is 00 01.
std::string escaped(std::string_view label) {
  std::string out = "l";
  for (const char c : label) {
    out.push_back(c);
    if (c == '\0') out.push_back('\xff');
  }
  return out;
}

}  // namespace

bool is_known(char first) { return std::string_view("\0msgqhwcvlide", 13).find(first) != std::string_view::npos; }

std::string map_state() { return "m"; }

std::string session(SessionNumber number) {
  std::string key(all_sessions());
  put_u32(key, number);
  return key;
}
std::string_view all_sessions() { return "s"; }
std::optional<SessionNumber> session_of(std::string_view key) {
  if (key.size() != kSessionKey || !key.starts_with(all_sessions())) return std::nullopt;
  return get_u32(key.substr(all_sessions().size()));
}

std::string skipped_in(SessionNumber session) {
  std::string key(all_skipped());
  put_u32(key, session);
  return key;
}
std::string skipped(SessionNumber session, std::uint32_t to) {
  std::string key = skipped_in(session);
  put_u32(key, to);
  return key;
}
std::string_view all_skipped() { return "g"; }

std::string edit(std::uint64_t sequence) {
  std::string key(all_edits());
  put_u32(key, static_cast<std::uint32_t>(sequence >> 32));
  put_u32(key, static_cast<std::uint32_t>(sequence));
  return key;
}
std::string_view all_edits() { return "i"; }
std::optional<std::uint64_t> edit_of(std::string_view key) {
  if (key.size() != 9 || !key.starts_with(all_edits())) return std::nullopt;
  return (std::uint64_t{get_u32(key.substr(1))} << 32) | get_u32(key.substr(5));
}

std::string events(std::uint64_t sequence, std::uint32_t ordinal) {
  std::string key(all_events());
  put_u32(key, static_cast<std::uint32_t>(sequence >> 32));
  put_u32(key, static_cast<std::uint32_t>(sequence));
  put_u32(key, ordinal);
  return key;
}
std::string_view all_events() { return "e"; }
std::optional<EventKey> events_of(std::string_view key) {
  if (key.size() != 13 || !key.starts_with(all_events())) return std::nullopt;
  return EventKey{(std::uint64_t{get_u32(key.substr(1))} << 32) | get_u32(key.substr(5)), get_u32(key.substr(9))};
}

std::string pending(ChunkId id) { return chunk_key(all_pending(), id); }
std::string_view all_pending() { return "q"; }
std::optional<ChunkId> pending_of(std::string_view key) {
  if (key.size() != kChunkKey) return std::nullopt;
  return ChunkId{get_u32(key.substr(1)), get_u32(key.substr(5))};
}

std::string digests(ChunkId id) { return chunk_key(all_digests(), id); }
std::string_view all_digests() { return "d"; }
std::optional<ChunkId> digests_of(std::string_view key) {
  if (key.size() != kChunkKey || !key.starts_with(all_digests())) return std::nullopt;
  return ChunkId{get_u32(key.substr(1)), get_u32(key.substr(5))};
}

std::string part(Part part, ChunkId id) {
  const char first = family(part);
  return chunk_key({&first, 1}, id);
}

std::string frame(Part p, FrameId id) {
  std::string key = part(p, chunk_id(id));
  key.push_back(static_cast<char>(slot_of(id)));
  return key;
}

std::optional<FrameId> frame_of(std::string_view key) {
  if (key.size() != kFrameKey) return std::nullopt;
  const auto slot = static_cast<std::uint8_t>(key.back());
  if (slot >= kFramesPerChunk) return std::nullopt;
  return frame_in({get_u32(key.substr(1)), get_u32(key.substr(5))}, slot);
}

std::optional<PartKey> part_of(std::string_view key) {
  if (key.size() != kFrameKey && key.size() != kChunkKey) return std::nullopt;
  for (const Part part : {Part::kHot, Part::kWarm, Part::kCold, Part::kWords}) {
    if (key[0] != family(part)) continue;
    PartKey found{part, {get_u32(key.substr(1)), get_u32(key.substr(5))}, std::nullopt};
    if (key.size() == kFrameKey) found.slot = static_cast<std::uint8_t>(key.back());
    if (found.slot && *found.slot >= kFramesPerChunk) return std::nullopt;
    return found;
  }
  return std::nullopt;
}

std::string labelled(std::string_view label) { return escaped(label) + std::string("\0\1", 2); }

std::string labels_beginning(std::string_view prefix) { return escaped(prefix); }

std::string label(std::string_view label, FrameId id) {
  std::string key = labelled(label);
  put_u32(key, id.session);
  put_u32(key, id.index);
  return key;
}

std::optional<LabelKey> label_of(std::string_view key) {
  LabelKey out;
  std::size_t i = 1;
  for (; i + 1 < key.size(); ++i) {
    if (key[i] != '\0') {
      out.label.push_back(key[i]);
    } else if (key[++i] == '\xff') {
      out.label.push_back('\0');
    } else {
      ++i;
      break;
    }
  }
  if (key.size() != i + 8) return std::nullopt;
  out.frame = {get_u32(key.substr(i)), get_u32(key.substr(i + 4))};
  return out;
}

}  // namespace relmap::storage::keys
