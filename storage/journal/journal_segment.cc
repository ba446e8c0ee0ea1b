#include "storage/journal/journal_segment.h"

#include <algorithm>
#include <array>
#include <cinttypes>
#include <cstdio>
#include <cstring>
#include <random>

#include "proto/base/crc32c.h"

namespace relmap::storage {
namespace {

constexpr std::uint32_t kSegmentMagic = 0x4c4a4d52;  // "RMJL"
constexpr std::uint16_t kUnsalted = 1, kSegmentVersion = 2;
constexpr std::size_t kSaltBytes = sizeof(std::uint64_t);
// Sizes without the salt. It stands before the reserved field in a segment's header, and at the beginning of a
// record's.
constexpr std::size_t kSegmentHeaderBytes = 24;
constexpr std::size_t kRecordHeaderBytes = 24;

struct RecordHeader {
  std::uint32_t length, crc;
  std::uint64_t sequence, acknowledged_through;
};

RecordHeader get_record_header(ByteReader& r) {
  RecordHeader h{};
  h.length = r.get<std::uint32_t>();
  h.crc = r.get<std::uint32_t>();
  h.sequence = r.get<std::uint64_t>();
  h.acknowledged_through = r.get<std::uint64_t>();
  return h;
}

std::array<std::uint8_t, kSaltBytes> salt_bytes(std::uint64_t salt) {
  std::array<std::uint8_t, kSaltBytes> bytes;
  std::memcpy(bytes.data(), &salt, kSaltBytes);
  return bytes;
}

// CRC of a record: of the bytes before the checksum (with the salt, if there is one), those behind it, and the payload.
std::uint32_t record_crc(ByteSpan before, ByteSpan behind, ByteSpan payload) {
  return crc32c(payload, crc32c(behind, crc32c(before)));
}

}  // namespace

std::string SegmentName::to_string() const {
  char name[64];
  if (salt)
    std::snprintf(name, sizeof name, "journal-%020" PRIu64 "-%016" PRIx64 ".log", first, *salt);
  else
    std::snprintf(name, sizeof name, "journal-%020" PRIu64 ".log", first);
  return name;
}

std::optional<SegmentName> SegmentName::parse(const std::string& file) {
  SegmentName name;
  std::uint64_t salt = 0;
  if (std::sscanf(file.c_str(), "journal-%20" SCNu64 "-%16" SCNx64, &name.first, &salt) == 2) name.salt = salt;
  if (name.first == 0 || name.to_string() != file) return std::nullopt;
  return name;
}

std::uint64_t random_salt() {
  std::random_device device;
  return (std::uint64_t{device()} << 32) | device();
}

Bytes segment_header(std::uint64_t first, std::uint64_t salt) {
  ByteWriter w;
  w.put(kSegmentMagic);
  w.put(kSegmentVersion);
  w.put(std::uint16_t{0});
  w.put(first);
  w.put(salt);
  w.put(std::uint32_t{0});  // reserved
  w.put(crc32c(w.bytes()));
  return w.take();
}

void put_journal_record(ByteWriter& w, std::uint64_t salt, std::uint64_t sequence, std::uint64_t acknowledged_through,
                        ByteSpan payload) {
  const std::size_t begin = w.size();
  w.put(salt);
  w.put(static_cast<std::uint32_t>(payload.size()));
  const std::size_t crc_at = w.size();
  w.put(std::uint32_t{0});
  w.put(sequence);
  w.put(acknowledged_through);
  const ByteSpan head(w.bytes());
  const std::uint32_t crc =
      record_crc(head.subspan(begin, crc_at - begin), head.subspan(crc_at + sizeof(std::uint32_t)), payload);
  w.patch(crc_at, crc);
  w.put_bytes(payload);
}

std::uint64_t SegmentReader::first_offset() const { return kSegmentHeaderBytes + (salt_ ? kSaltBytes : 0); }

Result<SegmentReader> SegmentReader::open(const FileSystem& files, const std::string& path) {
  SegmentReader reader;
  auto file = files.open_read(path);
  if (!file.ok()) return file.status();
  reader.file_ = std::move(*file);
  if (const auto name = SegmentName::parse(path.substr(path.rfind('/') + 1))) reader.salt_ = name->salt;
  const auto bytes = reader.file_->read(0, std::min<std::uint64_t>(reader.size(), kSegmentHeaderBytes + kSaltBytes));
  if (!bytes.ok()) return bytes.status();
  ByteReader r(*bytes);
  const auto magic = r.get<std::uint32_t>();
  const auto version = r.get<std::uint16_t>();
  r.get<std::uint16_t>();
  r.get<std::uint64_t>();  // the first sequence, as in the name
  std::optional<std::uint64_t> salt;
  if (version != kUnsalted) salt = r.get<std::uint64_t>();
  r.get<std::uint32_t>();
  const std::size_t before_crc = r.position();
  if (magic != kSegmentMagic || r.get<std::uint32_t>() != crc32c(ByteSpan(*bytes).first(before_crc)) || !r.ok())
    return reader;
  if (version < kUnsalted || version > kSegmentVersion)
    return Status(Reason::UNKNOWN_FORMAT_VERSION, path + " is of version " + std::to_string(version));
  if (salt != reader.salt_) return Status(Reason::CORRUPT, path + " is not the segment that its name says");
  reader.header_whole_ = true;
  return reader;
}

Result<std::optional<SegmentRecord>> SegmentReader::record_at(std::uint64_t offset) const {
  const std::size_t salt_size = salt_ ? kSaltBytes : 0;
  const std::size_t head_size = salt_size + kRecordHeaderBytes;
  if (searched_ && searched_->begin <= offset) return searched_at(offset, 0, ~std::uint64_t{0});
  if (offset > size() || size() - offset < head_size) return std::optional<SegmentRecord>();
  const auto head = file_->read(offset, head_size);
  if (!head.ok()) return head.status();
  ByteReader r(*head);
  if (salt_ && r.get<std::uint64_t>() != *salt_) return std::optional<SegmentRecord>();
  const RecordHeader h = get_record_header(r);
  if (h.length > kMaxRecordBytes || h.length > size() - offset - head_size || h.acknowledged_through >= h.sequence)
    return std::optional<SegmentRecord>();
  auto payload = file_->read(offset + head_size, h.length);
  if (!payload.ok()) return payload.status();
  const ByteSpan bytes(*head);
  if (h.crc != record_crc(bytes.first(salt_size + sizeof h.length),
                          bytes.subspan(salt_size + sizeof h.length + sizeof h.crc), *payload))
    return std::optional<SegmentRecord>();
  return std::optional<SegmentRecord>(
      {h.sequence, h.acknowledged_through, offset, offset + head_size + h.length, std::move(*payload)});
}

// The record at `offset` of what was read for a search, if its sequence is after `after`, by at most `far`.
std::optional<SegmentRecord> SegmentReader::searched_at(std::uint64_t offset, std::uint64_t after,
                                                        std::uint64_t far) const {
  const std::size_t salt_size = salt_ ? kSaltBytes : 0;
  const std::size_t head_size = salt_size + kRecordHeaderBytes;
  const std::size_t at = offset - searched_->begin;
  const ByteSpan all(searched_->bytes);
  if (at > all.size() || all.size() - at < head_size) return std::nullopt;
  const ByteSpan head = all.subspan(at, head_size);
  ByteReader r(head);
  if (salt_ && r.get<std::uint64_t>() != *salt_) return std::nullopt;
  const RecordHeader h = get_record_header(r);
  if (h.sequence <= after || h.sequence - after > far || h.acknowledged_through >= h.sequence ||
      h.length > kMaxRecordBytes || h.length > all.size() - at - head_size)
    return std::nullopt;
  const std::uint32_t of_head =
      record_crc(head.first(salt_size + sizeof h.length), head.subspan(salt_size + sizeof h.length + sizeof h.crc), {});
  if (h.crc != searched_->crc.of(at + head_size, h.length, of_head)) return std::nullopt;
  const ByteSpan payload = all.subspan(at + head_size, h.length);
  return SegmentRecord{
      h.sequence, h.acknowledged_through, offset, offset + head_size + h.length, {payload.begin(), payload.end()}};
}

Result<std::optional<SegmentRecord>> SegmentReader::find_after(std::uint64_t offset, std::uint64_t after) const {
  constexpr std::uint64_t kFar = 1u << 24;  // more records than a segment can hold: a sequence beyond is not one
  if (offset >= size()) return std::optional<SegmentRecord>();
  if (!searched_ || searched_->begin > offset) {
    auto rest = file_->read(offset, size() - offset);
    if (!rest.ok()) return rest.status();
    searched_ = std::make_unique<Searched>(offset, std::move(*rest));
  }
  const Bytes& bytes = searched_->bytes;
  const auto salt = salt_bytes(salt_.value_or(0));
  for (auto at = bytes.begin() + static_cast<std::ptrdiff_t>(offset - searched_->begin);; ++at) {
    if (salt_) at = std::search(at, bytes.end(), salt.begin(), salt.end());
    if (at == bytes.end()) return std::optional<SegmentRecord>();
    auto record = searched_at(searched_->begin + static_cast<std::uint64_t>(at - bytes.begin()), after, kFar);
    if (record) return record;
  }
}

}  // namespace relmap::storage
