#include "storage/part_loader.h"

#include <algorithm>

#include "storage/chunk_codec.h"
#include "storage/frame_codec.h"
#include "storage/keys.h"

namespace relmap {
namespace {

[[noreturn]] void lost(Part part, const std::string& where, const std::string& what) {
  static constexpr const char* kNames[] = {"?", "hot", "warm", "cold", "words"};
  throw StatusError(
      Status(Reason::DATA_LOSS, std::string(kNames[static_cast<int>(part)]) + " part of " + where + ": " + what));
}

std::optional<Bytes> get(const EngineSnapshot& snapshot, const std::string& key) {
  return snapshot.get(key).or_throw();
}

// Calls take(slot, body) for each frame of a container.
template <typename Take>
std::uint64_t unpack(ByteSpan bytes, Part part, ChunkId id, Take take) {
  const auto reader = PartReader::open(bytes, part, id);
  if (!reader.ok()) lost(part, "chunk " + id.to_string(), reader.status().to_string());
  for (std::size_t i = 0; i < reader->size(); ++i) {
    const auto body = reader->body(i);
    if (!body.ok()) lost(part, "frame " + frame_in(id, reader->slot(i)).to_string(), body.status().to_string());
    if (!take(reader->slot(i), *body))
      lost(part, "frame " + frame_in(id, reader->slot(i)).to_string(), "malformed record");
  }
  return reader->commit();
}

template <typename Frame, typename Decode>
LoadedPart<Frame> load(const EngineSnapshot& snapshot, Part part, ChunkId id, Decode decode) {
  LoadedPart<Frame> loaded;
  loaded.bytes = sizeof loaded.frames;
  const auto take = [&](std::uint32_t slot, ByteSpan body) {
    auto frame = decode(body);
    if (!frame) return false;
    loaded.bytes += memory_bytes(*frame);
    loaded.frames[slot] = std::make_shared<const Frame>(std::move(*frame));
    return true;
  };
  const std::string key = keys::part(part, id);
  if (const auto closed = get(snapshot, key)) {
    loaded.commit = unpack(*closed, part, id, take);
    return loaded;
  }
  const Status status = snapshot.scan(key, [&](std::string_view, ByteSpan value) {
    loaded.commit = std::max(loaded.commit, unpack(value, part, id, take));
    return true;
  });
  if (!status.ok()) throw StatusError(status);
  return loaded;
}

}  // namespace

LoadedPart<FrameHot> load_hot(const EngineSnapshot& snapshot, ChunkId id) {
  return load<FrameHot>(snapshot, Part::kHot, id, decode_hot);
}

LoadedPart<FrameWarm> load_warm(const EngineSnapshot& snapshot, ChunkId id) {
  return load<FrameWarm>(snapshot, Part::kWarm, id, decode_warm);
}

std::vector<std::uint32_t> decode_words_record(ByteSpan record, FrameId id) {
  std::optional<std::vector<std::uint32_t>> words;
  unpack(record, Part::kWords, chunk_id(id), [&](std::uint32_t slot, ByteSpan body) {
    words = decode_words(body);
    return words.has_value() && slot == slot_of(id);
  });
  if (!words) lost(Part::kWords, "frame " + id.to_string(), "an empty record");
  return std::move(*words);
}

LoadedCold load_cold(const EngineSnapshot& snapshot, FrameId id) {
  LoadedCold loaded;
  const auto bytes = get(snapshot, keys::frame(Part::kCold, id));
  if (!bytes) return loaded;
  std::optional<FrameCold> frame;
  loaded.commit = unpack(*bytes, Part::kCold, chunk_id(id), [&](std::uint32_t slot, ByteSpan body) {
    frame = decode_cold(body);
    return frame.has_value() && slot == slot_of(id);
  });
  if (!frame) lost(Part::kCold, "frame " + id.to_string(), "an empty record");
  const auto words = get(snapshot, keys::frame(Part::kWords, id));
  if (!words) lost(Part::kWords, "frame " + id.to_string(), "missing");
  frame->words = decode_words_record(*words, id);
  loaded.frame = std::make_shared<const FrameCold>(std::move(*frame));
  return loaded;
}

}  // namespace relmap
