#include "storage/journal_segment.h"

#include <algorithm>
#include <cinttypes>
#include <cstdio>

#include "proto/crc32c.h"

namespace relmap {
namespace {

constexpr std::uint32_t kMagic = 0x4c4a4d52;  // "RMJL"
constexpr std::uint16_t kVersion = 1;

struct RecordHeader {
  std::uint32_t length, crc;
  std::uint64_t sequence, acknowledged_through;
};

RecordHeader get_header(ByteReader& r) {
  RecordHeader h{};
  h.length = r.get<std::uint32_t>();
  h.crc = r.get<std::uint32_t>();
  h.sequence = r.get<std::uint64_t>();
  h.acknowledged_through = r.get<std::uint64_t>();
  return h;
}

bool plausible(const RecordHeader& h, std::uint64_t offset, std::uint64_t size) {
  return h.length <= kMaxRecordBytes && h.length + kRecordHeaderBytes <= size - offset &&
         h.acknowledged_through < h.sequence;
}

}  // namespace

std::uint64_t journal_sequence_in(const std::string& name) {
  std::uint64_t sequence = 0;
  int end = 0;
  if (std::sscanf(name.c_str(), "journal-%20" SCNu64 ".log%n", &sequence, &end) != 1) return 0;
  return end == static_cast<int>(name.size()) ? sequence : 0;
}

Bytes segment_header(std::uint64_t first) {
  ByteWriter w;
  w.put(kMagic);
  w.put(kVersion);
  w.put(std::uint16_t{0});
  w.put(first);
  w.put(std::uint32_t{0});  // room to grow
  w.put(crc32c(w.bytes()));
  return w.take();
}

void put_journal_record(ByteWriter& w, std::uint64_t sequence, std::uint64_t acknowledged_through, ByteSpan payload) {
  w.put(static_cast<std::uint32_t>(payload.size()));
  const std::size_t crc_at = w.size();
  w.put(std::uint32_t{0});
  w.put(sequence);
  w.put(acknowledged_through);
  w.put_bytes(payload);
  const ByteSpan all(w.bytes());
  w.patch(crc_at, crc32c(all.subspan(crc_at + 4), crc32c(all.subspan(crc_at - 4, 4))));
}

Result<SegmentReader> SegmentReader::open(const FileSystem& files, const std::string& path) {
  SegmentReader reader;
  auto file = files.open_read(path);
  if (!file.ok()) return file.status();
  reader.file_ = std::move(*file);
  if (reader.size() < kSegmentHeaderBytes) return reader;
  const auto bytes = reader.file_->read(0, kSegmentHeaderBytes);
  if (!bytes.ok()) return bytes.status();
  ByteReader r(*bytes);
  const auto magic = r.get<std::uint32_t>();
  const auto version = r.get<std::uint16_t>();
  r.get_bytes(kSegmentHeaderBytes - 10);
  const auto crc = r.get<std::uint32_t>();
  if (magic != kMagic || crc != crc32c(ByteSpan(*bytes).first(kSegmentHeaderBytes - sizeof crc))) return reader;
  if (version != kVersion)
    return Status(Reason::UNKNOWN_FORMAT_VERSION, path + " is of version " + std::to_string(version));
  reader.header_whole_ = true;
  return reader;
}

Result<std::optional<SegmentRecord>> SegmentReader::record_at(std::uint64_t offset) const {
  if (offset > size() || size() - offset < kRecordHeaderBytes) return std::optional<SegmentRecord>();
  const auto head = file_->read(offset, kRecordHeaderBytes);
  if (!head.ok()) return head.status();
  ByteReader r(*head);
  const RecordHeader h = get_header(r);
  if (!plausible(h, offset, size())) return std::optional<SegmentRecord>();
  auto payload = file_->read(offset + kRecordHeaderBytes, h.length);
  if (!payload.ok()) return payload.status();
  const ByteSpan bytes(*head);
  if (h.crc != crc32c(*payload, crc32c(bytes.subspan(8), crc32c(bytes.first(4)))))
    return std::optional<SegmentRecord>();
  return std::optional<SegmentRecord>(
      {h.sequence, h.acknowledged_through, offset, offset + kRecordHeaderBytes + h.length, std::move(*payload)});
}

Result<std::optional<SegmentRecord>> SegmentReader::find_after(std::uint64_t offset, std::uint64_t after) const {
  constexpr std::uint64_t kFar = 1u << 24;  // records that one segment cannot hold: a sequence beyond is no sequence
  if (offset >= size()) return std::optional<SegmentRecord>();
  const auto rest = file_->read(offset, size() - offset);
  if (!rest.ok()) return rest.status();
  for (std::size_t i = 0; i + kRecordHeaderBytes <= rest->size(); ++i) {
    ByteReader r(ByteSpan(*rest).subspan(i));
    const RecordHeader h = get_header(r);
    if (!plausible(h, offset + i, size()) || h.sequence <= after || h.sequence - after > kFar) continue;
    auto record = record_at(offset + i);
    if (!record.ok() || *record) return record;
  }
  return std::optional<SegmentRecord>();
}

}  // namespace relmap
