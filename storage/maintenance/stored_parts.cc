#include "storage/maintenance/stored_parts.h"

#include <algorithm>
#include <optional>

#include "storage/format/chunk_codec.h"
#include "storage/format/frame_codec.h"
#include "storage/format/keys.h"

namespace relmap::storage {
namespace {

// The chunk of a part's key; nullopt if it is not the key of a part.
std::optional<ChunkId> chunk_of_key(std::string_view key) {
  if (key.size() != keys::kChunkKey && key.size() != keys::kFrameKey) return std::nullopt;
  const auto frame = keys::frame_of(std::string(key.substr(0, keys::kChunkKey)) + '\0');
  return frame ? std::optional<ChunkId>(chunk_id(*frame)) : std::nullopt;
}

// Walks the keys of a part of a session in their order. A scan that breaks off is resumed behind the break: over longer
// and longer prefixes, which narrow the break down, and at last key by key.
class Walk {
 public:
  Walk(const EngineSnapshot& snapshot, ChunkSpan span, const VisitRecord& visit)
      : snapshot_(snapshot), span_(span), visit_(visit) {}

  // Visits the keys that begin with `prefix`; `first` is the lowest chunk that they can have. False if told to stop.
  bool run(const std::string& prefix, std::uint32_t first) {
    const Status scanned = snapshot_.scan(prefix, [&](std::string_view key, ByteSpan value) {
      if (key <= last_) return true;  // visited before the break
      last_ = key;
      going_ = visit_(key, value, Status());
      return going_;
    });
    if (scanned.ok() || !going_) return going_;
    if (prefix.size() >= keys::kChunkKey) return run_singly(prefix);
    const std::uint32_t step = std::uint32_t{1} << (8 * (keys::kChunkKey - prefix.size() - 1));
    for (std::uint32_t byte = 0; byte < 256 && going_; ++byte) {
      const std::uint32_t low = first + byte * step, high = low + (step - 1);
      if (high < span_.first || low > span_.last) continue;
      std::string longer = prefix + static_cast<char>(byte);
      if (longer < last_ && !last_.starts_with(longer)) continue;
      run(longer, low);
    }
    return going_;
  }

 private:
  bool run_singly(const std::string& chunk_key) {
    tell(chunk_key);
    for (std::uint32_t slot = 0; slot < kFramesPerChunk && going_; ++slot) tell(chunk_key + static_cast<char>(slot));
    return going_;
  }
  void tell(const std::string& key) {
    if (!going_ || key <= last_) return;
    const auto value = snapshot_.get(key);
    if (value.ok() && !*value) return;
    last_ = key;
    going_ = visit_(key, value.ok() ? ByteSpan(**value) : ByteSpan(), value.status());
  }

  const EngineSnapshot& snapshot_;
  const ChunkSpan span_;
  const VisitRecord& visit_;
  std::string last_;  // the last key visited
  bool going_ = true;
};

std::optional<FrameHot> decode(ByteSpan body, FrameId id, const FrameHot*) { return decode_hot(body, id); }
std::optional<FrameWarm> decode(ByteSpan body, FrameId id, const FrameWarm*) { return decode_warm(body, id); }
std::optional<FrameCold> decode(ByteSpan body, FrameId, const FrameCold*) { return decode_cold(body); }
std::optional<FrameWords> decode(ByteSpan body, FrameId, const FrameWords*) { return decode_words(body); }

std::size_t memory_bytes(const FrameWords& words) { return sizeof words + words.capacity() * sizeof(words[0]) + 32; }

std::string slots_named(ChunkId id, std::uint64_t slots) {
  std::string names;
  for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot)
    if ((slots >> slot) & 1) names += (names.empty() ? "" : ", ") + frame_in(id, slot).to_string();
  return names;
}

// Decodes one record of a chunk into it.
template <typename Frame>
void take(StoredPart<Frame>& part, std::string_view key, ByteSpan value, const Status& status) {
  constexpr Part kPart = kPartOf<Frame>;
  part.keys.emplace_back(key);
  const bool single = key.size() == keys::kFrameKey;
  const auto slot_of_key = static_cast<std::uint8_t>(key.back());
  const auto lost = [&](std::uint64_t slots, const std::string& why) {
    const std::string where = slots ? "frame " + slots_named(part.id, slots) : "chunk " + part.id.to_string();
    part.damage.push_back(
        {kPart, std::string(key), part.id, slots, std::string(part_name(kPart)) + " part of " + where + ": " + why});
  };
  const std::uint64_t own = single && slot_of_key < kFramesPerChunk ? std::uint64_t{1} << slot_of_key : 0;
  if (!status.ok()) return lost(own, status.to_string());
  const auto reader = PartReader::open(value, kPart, part.id);
  if (!reader.ok()) return lost(own, reader.status().to_string());
  if (single && (reader->size() != 1 || reader->slot(0) != slot_of_key))
    return lost(own, "the record is of another frame");
  for (std::size_t i = 0; i < reader->size(); ++i) {
    const std::uint32_t slot = reader->slot(i);
    const std::uint64_t bit = std::uint64_t{1} << slot;
    const auto body = reader->body(i);
    auto frame = body.ok() ? decode(*body, frame_in(part.id, slot), static_cast<const Frame*>(nullptr)) : std::nullopt;
    if (!frame)
      lost(bit, body.ok() ? "malformed record" : body.status().to_string());
    else if (part.frames[slot])
      lost(bit, "stands twice, by itself and with its chunk");
    else
      part.bytes += memory_bytes(*frame), part.frames[slot] = std::make_shared<const Frame>(std::move(*frame));
  }
}

std::string session_key(Part part, SessionNumber session) {
  return keys::part(part, {session, 0}).substr(0, keys::kSessionKey);
}

}  // namespace

bool for_each_record(const EngineSnapshot& snapshot, Part part, SessionNumber session, ChunkSpan span,
                     const VisitRecord& visit) {
  return Walk(snapshot, span, visit).run(session_key(part, session), 0);
}

template <typename Frame>
bool for_each_part(const EngineSnapshot& snapshot, SessionNumber session, ChunkSpan span,
                   const std::function<bool(StoredPart<Frame>)>& visit) {
  StoredPart<Frame> part;
  const auto begun = [&] { return !part.keys.empty() || !part.damage.empty(); };
  const VisitRecord gather = [&](std::string_view key, ByteSpan value, const Status& status) {
    const auto id = chunk_of_key(key);
    if (id && begun() && *id != part.id) {
      if (!visit(std::exchange(part, {}))) return false;
    }
    if (id) part.id = *id;
    if (id)
      take(part, key, value, status);
    else
      part.damage.push_back({kPartOf<Frame>, std::string(key), part.id, 0, "a key that names no frame"});
    return true;
  };
  if (!for_each_record(snapshot, kPartOf<Frame>, session, span, gather)) return false;
  return !begun() || visit(std::move(part));
}

template <typename Frame>
StoredPart<Frame> load_part(const EngineSnapshot& snapshot, ChunkId id) {
  StoredPart<Frame> part;
  part.id = id;
  const std::string key = keys::part(kPartOf<Frame>, id);
  if (const auto whole = snapshot.get(key); whole.ok() && *whole) {
    take(part, key, **whole, Status());
    return part;
  }
  const VisitRecord gather = [&](std::string_view k, ByteSpan value, const Status& status) {
    take(part, k, value, status);
    return true;
  };
  Walk(snapshot, {id.chunk, id.chunk}, gather).run(key, id.chunk);
  return part;
}

bool has_parts(const EngineSnapshot& snapshot, Part part, SessionNumber session) {
  bool any = false;
  (void)snapshot.scan(session_key(part, session), [&](std::string_view, ByteSpan) {
    any = true;
    return false;
  });
  return any;
}

#define RELMAP_INSTANTIATE(Frame)                                                     \
  template bool for_each_part<Frame>(const EngineSnapshot&, SessionNumber, ChunkSpan, \
                                     const std::function<bool(StoredPart<Frame>)>&);  \
  template StoredPart<Frame> load_part<Frame>(const EngineSnapshot&, ChunkId);
RELMAP_INSTANTIATE(FrameHot)
RELMAP_INSTANTIATE(FrameWarm)
RELMAP_INSTANTIATE(FrameCold)
RELMAP_INSTANTIATE(FrameWords)
#undef RELMAP_INSTANTIATE

}  // namespace relmap::storage
