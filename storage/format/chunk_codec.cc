#include "storage/format/chunk_codec.h"

#include <cassert>

#include "proto/base/crc32c.h"

namespace relmap::storage {
namespace {

constexpr std::uint32_t kPartMagic = 0x54504d52;  // "RMPT"
constexpr std::size_t kPartHeaderBytes = 32;
constexpr std::size_t kEntryBytes = 12;

}  // namespace

void PartWriter::add(std::uint32_t slot, ByteSpan body) { copy(slot, body, crc32c(body)); }

void PartWriter::copy(std::uint32_t slot, ByteSpan body, std::uint32_t crc) {
  assert(slot < kFramesPerChunk && (entries_.empty() || entries_.back().slot < slot));
  entries_.push_back({static_cast<std::uint8_t>(slot), static_cast<std::uint32_t>(body.size()), crc});
  bodies_.put_bytes(body);
}

Bytes PartWriter::finish() const {
  ByteWriter w;
  w.reserve(kPartHeaderBytes + entries_.size() * kEntryBytes + sizeof(std::uint32_t) + bodies_.size());
  w.put(kPartMagic);
  w.put(kPartVersion);
  w.put(part_);
  w.put(static_cast<std::uint8_t>(entries_.size()));
  w.put(id_.session);
  w.put(id_.chunk);
  w.put(commit_);
  w.put(std::uint64_t{0});  // reserved
  for (const Entry& entry : entries_) {
    w.put(std::uint32_t{entry.slot});
    w.put(entry.length);
    w.put(entry.crc);
  }
  w.put(crc32c(w.bytes()));
  w.put_bytes(bodies_.bytes());
  return w.take();
}

Bytes frame_container(Part part, FrameId id, std::uint64_t commit, ByteSpan body) {
  PartWriter writer(part, chunk_id(id), commit);
  writer.add(slot_of(id), body);
  return writer.finish();
}

Result<PartReader> PartReader::open(ByteSpan bytes, Part part, ChunkId id, std::uint16_t version) {
  ByteReader r(bytes);
  const auto magic = r.get<std::uint32_t>();
  const auto stored_version = r.get<std::uint16_t>();
  const auto stored_part = r.get<Part>();
  const auto count = r.get<std::uint8_t>();
  const ChunkId stored_id{r.get<std::uint32_t>(), r.get<std::uint32_t>()};
  PartReader reader;
  reader.commit_ = r.get<std::uint64_t>();
  r.get<std::uint64_t>();
  const ByteSpan index = r.get_bytes(count * kEntryBytes);
  const auto crc = r.get<std::uint32_t>();
  if (!r.ok()) return Status(Reason::TRUNCATED, "a chunk part of " + std::to_string(bytes.size()) + " bytes");
  if (crc != crc32c(bytes.first(kPartHeaderBytes + index.size())) || magic != kPartMagic)
    return Status(Reason::CORRUPT, "header of a chunk part");
  if (stored_version != version)
    return Status(Reason::UNKNOWN_FORMAT_VERSION, "chunk part of version " + std::to_string(stored_version));
  if (stored_part != part || stored_id != id)
    return Status(Reason::CORRUPT, "part " + std::to_string(static_cast<int>(stored_part)) + " of chunk " +
                                       stored_id.to_string() + " where part " + std::to_string(static_cast<int>(part)) +
                                       " of " + id.to_string() + " belongs");
  ByteReader entries(index);
  std::uint32_t next = 0;
  for (int i = 0; i < count; ++i) {
    const auto slot = entries.get<std::uint32_t>();
    const auto length = entries.get<std::uint32_t>();
    const auto body_crc = entries.get<std::uint32_t>();
    if (slot < next || slot >= kFramesPerChunk) return Status(Reason::CORRUPT, "index of a chunk part");
    next = slot + 1;
    reader.entries_.push_back({static_cast<std::uint8_t>(slot), body_crc, r.get_bytes(length)});
  }
  if (!r.ok()) return Status(Reason::TRUNCATED, "a chunk part of " + std::to_string(bytes.size()) + " bytes");
  if (!r.at_end()) return Status(Reason::CORRUPT, "a chunk part is longer than its index says");
  return reader;
}

Result<ByteSpan> PartReader::body(std::size_t i) const {
  const Entry& entry = entries_[i];
  if (crc32c(entry.body) != entry.crc)
    return Status(Reason::CORRUPT, "record of slot " + std::to_string(entry.slot) + " of a chunk part");
  return entry.body;
}

}  // namespace relmap::storage
