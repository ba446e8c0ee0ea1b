#include "storage/map/part_loader.h"

#include <utility>

#include "storage/format/frame_codec.h"
#include "storage/format/keys.h"

namespace relmap::storage {
namespace {

std::optional<Bytes> get(const EngineSnapshot& snapshot, const std::string& key) {
  return snapshot.get(key).or_throw();
}

// Calls take(body) for the frame in a container of one, and returns the number of the commit that wrote it.
template <typename Take>
std::uint64_t open_single(ByteSpan bytes, Part part, FrameId id, Take take) {
  const auto reader = PartReader::open(bytes, part, chunk_id(id));
  if (!reader.ok()) throw_lost(part, "frame " + id.to_string(), reader.status().to_string());
  if (reader->size() != 1 || reader->slot(0) != slot_of(id))
    throw_lost(part, "frame " + id.to_string(), "another frame's record");
  const auto body = reader->body(0);
  if (!body.ok()) throw_lost(part, "frame " + id.to_string(), body.status().to_string());
  if (!take(*body)) throw_lost(part, "frame " + id.to_string(), "malformed record");
  return reader->commit();
}

}  // namespace

template <typename Frame>
LoadedPart<Frame> load_packed(const EngineSnapshot& snapshot, ChunkId id, std::shared_ptr<Budget> budget) {
  typename PackedPart<Frame>::Records records;
  LoadedPart<Frame> loaded;
  const std::string key = keys::part(kPartOf<Frame>, id);
  if (auto closed = get(snapshot, key)) {
    const Status opened = unpack<Frame>(std::make_shared<const Bytes>(std::move(*closed)), id, records, &loaded.commit);
    if (!opened.ok()) throw_lost(kPartOf<Frame>, "chunk " + id.to_string(), opened.to_string());
  } else {
    const Status scanned = snapshot.scan(key, [&](std::string_view frame_key, ByteSpan value) {
      const auto opened =
          unpack<Frame>(std::make_shared<const Bytes>(value.begin(), value.end()), id, records, &loaded.commit);
      const auto frame = keys::frame_of(frame_key);
      if (!opened.ok() && frame) {
        records[slot_of(*frame)].damage = std::make_shared<const Status>(opened);
        loaded.commit = std::max(loaded.commit, snapshot.commit_number());
      }
      return true;
    });
    throw_if(scanned);
  }
  loaded.part = std::make_shared<const PackedPart<Frame>>(std::move(budget), id, std::move(records));
  return loaded;
}

void scan_hot_parts(const EngineSnapshot& snapshot, ChunkId from, const std::shared_ptr<Budget>& budget,
                    const std::function<bool(const PackedPart<FrameHot>&)>& visit) {
  std::optional<ChunkId> at;
  PackedPart<FrameHot>::Records records;
  const auto give = [&] { return !at || visit(PackedPart<FrameHot>(budget, *at, std::exchange(records, {}))); };
  bool going = true;
  const std::string first = keys::part(Part::kHot, from);
  const Status scanned = snapshot.scan_from(first.substr(0, 1), first, [&](std::string_view key, ByteSpan value) {
    const auto part = keys::part_of(key);
    if (!part) return true;
    if (at && *at != part->chunk && !(going = give())) return false;
    at = part->chunk;
    std::uint64_t commit = 0;
    const Status opened =
        unpack<FrameHot>(std::make_shared<const Bytes>(value.begin(), value.end()), *at, records, &commit);
    if (opened.ok()) return true;
    const auto damage = std::make_shared<const Status>(opened);
    for (std::uint32_t slot = 0; slot < kFramesPerChunk; ++slot)
      if (!part->slot || *part->slot == slot) records[slot].damage = damage;
    return true;
  });
  throw_if(scanned);
  if (going) give();
}

template LoadedPart<FrameHot> load_packed(const EngineSnapshot&, ChunkId, std::shared_ptr<Budget>);
template LoadedPart<FrameWarm> load_packed(const EngineSnapshot&, ChunkId, std::shared_ptr<Budget>);

std::vector<std::uint32_t> decode_words_record(ByteSpan record, FrameId id) {
  std::vector<std::uint32_t> words;
  open_single(record, Part::kWords, id, [&](ByteSpan body) {
    auto decoded = decode_words(body);
    if (decoded) words = std::move(*decoded);
    return decoded.has_value();
  });
  return words;
}

LoadedCold load_cold(const EngineSnapshot& snapshot, FrameId id) {
  LoadedCold loaded;
  const auto bytes = get(snapshot, keys::frame(Part::kCold, id));
  if (!bytes) return loaded;
  FrameCold frame;
  loaded.commit = open_single(*bytes, Part::kCold, id, [&](ByteSpan body) {
    auto decoded = decode_cold(body);
    if (decoded) frame = std::move(*decoded);
    return decoded.has_value();
  });
  if (const auto words = get(snapshot, keys::frame(Part::kWords, id))) {
    frame.words = decode_words_record(*words, id);
  } else if (!frame.appearance.empty()) {
    throw_lost(Part::kWords, "frame " + id.to_string(), "missing");
  }
  loaded.frame = std::make_shared<const FrameCold>(std::move(frame));
  return loaded;
}

}  // namespace relmap::storage
