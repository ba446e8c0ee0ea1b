#include "storage/rocksdb/manifest_log.h"

#include <algorithm>
#include <charconv>

#include "proto/base/crc32c.h"

namespace relmap::storage {

namespace {

// Blocks of 32 KiB; records in one or more pieces, each with a masked CRC, a length and a type (1 whole, 2 first,
// 3 middle, 4 last).
constexpr std::size_t kLogBlock = 32768, kPieceHeader = 7;

// Of a type and what follows it, as RocksDB masks it.
std::uint32_t piece_crc(ByteSpan typed) {
  const std::uint32_t crc = crc32c(typed);
  return ((crc >> 15) | (crc << 17)) + 0xa282ead8u;
}

// Whether some sector has nothing but zeros in these bytes of a file.
bool lacks_a_sector(ByteSpan file, std::size_t begin) {
  constexpr std::size_t kSector = 512;
  while (begin < file.size()) {
    const std::size_t end = std::min(file.size(), (begin / kSector + 1) * kSector);
    const ByteSpan part = file.subspan(begin, end - begin);
    if (std::all_of(part.begin(), part.end(), [](std::uint8_t byte) { return byte == 0; })) return true;
    begin = end;
  }
  return false;
}

// The edit of a MANIFEST that adds a blob file.
Bytes blob_addition(const BlobFile& blob) {
  constexpr std::uint64_t kTag = 400, kFamilyTag = 200;
  Bytes edit;
  const auto put_varint = [&](std::uint64_t value) {
    for (; value >= 0x80; value >>= 7) edit.push_back(static_cast<std::uint8_t>(value | 0x80));
    edit.push_back(static_cast<std::uint8_t>(value));
  };
  put_varint(kTag);
  put_varint(blob.number);
  put_varint(blob.count);
  put_varint(blob.bytes);
  edit.insert(edit.end(), {0, 0, 0});  // no checksum's method and value; the end of the addition
  put_varint(kFamilyTag);
  put_varint(blob.family);
  return edit;
}

}  // namespace

std::vector<Bytes> read_log(ByteSpan log) {
  std::vector<Bytes> records;
  Bytes record;
  for (std::size_t at = 0; at + kPieceHeader <= log.size();) {
    if (kLogBlock - at % kLogBlock < kPieceHeader) {
      at += kLogBlock - at % kLogBlock;
      continue;
    }
    ByteReader r(log.subspan(at));
    r.get<std::uint32_t>();
    const auto length = r.get<std::uint16_t>();
    const auto type = r.get<std::uint8_t>();
    const ByteSpan piece = r.get_bytes(length);
    if (!r.ok() || type < 1 || type > 4) break;
    if (type == 1 || type == 2) record.clear();
    record.insert(record.end(), piece.begin(), piece.end());
    if (type == 1 || type == 4) {
      records.push_back(std::move(record));
      record.clear();
    }
    at += kPieceHeader + length;
  }
  return records;
}

std::size_t length_without_torn_end(ByteSpan log) {
  std::size_t whole = 0;
  for (std::size_t at = 0; at + kPieceHeader <= log.size();) {
    if (kLogBlock - at % kLogBlock < kPieceHeader) {
      at += kLogBlock - at % kLogBlock;
      continue;
    }
    ByteReader r(log.subspan(at));
    const auto crc = r.get<std::uint32_t>();
    const auto length = r.get<std::uint16_t>();
    const std::size_t end = at + kPieceHeader + length;
    if (end > log.size()) break;  // cut off, which RocksDB takes for an end
    const ByteSpan typed = log.subspan(at + kPieceHeader - 1, std::size_t{1} + length);
    if (piece_crc(typed) != crc) return end == log.size() && lacks_a_sector(log, at) ? whole : log.size();
    if (typed[0] == 1 || typed[0] == 4) whole = end;
    at = end;
  }
  return log.size();
}

void put_log_record(ByteWriter& w, ByteSpan record) {
  for (bool first = true, last = false; !last; first = false) {
    std::size_t left = kLogBlock - w.size() % kLogBlock;
    if (left < kPieceHeader) {
      w.put_bytes(Bytes(left, 0));
      left = kLogBlock;
    }
    const ByteSpan piece = record.first(std::min(record.size(), left - kPieceHeader));
    record = record.subspan(piece.size());
    last = record.empty();
    Bytes typed{static_cast<std::uint8_t>(first ? (last ? 1 : 2) : (last ? 4 : 3))};
    typed.insert(typed.end(), piece.begin(), piece.end());
    w.put(piece_crc(typed));
    w.put(static_cast<std::uint16_t>(piece.size()));
    w.put_bytes(typed);
  }
}

std::optional<BlobFile> blob_file(std::string_view stem, std::uint64_t size, ByteSpan header, ByteSpan footer) {
  BlobFile blob;
  const auto parsed = std::from_chars(stem.data(), stem.data() + stem.size(), blob.number);
  if (parsed.ec != std::errc() || parsed.ptr != stem.data() + stem.size()) return std::nullopt;
  ByteReader head(header), foot(footer);
  head.get<std::uint64_t>();
  blob.family = head.get<std::uint32_t>();
  if (size <= kBlobHeader + kBlobFooter) return blob;
  blob.bytes = size - kBlobHeader - kBlobFooter;
  foot.get<std::uint32_t>();
  blob.count = foot.get<std::uint64_t>();
  return blob;
}

Bytes with_blob_files(ByteSpan manifest, std::span<const BlobFile> blobs) {
  const std::vector<Bytes> records = read_log(manifest);
  // They go behind the last record that adds a family: tag 201 and the family's name.
  static constexpr std::string_view kFamilyAdded =
      "\xc9\x01\x04"
      "cold";
  const ByteSpan added = as_bytes(kFamilyAdded);
  std::size_t before = 0;
  for (std::size_t i = 0; i < records.size(); ++i)
    if (std::search(records[i].begin(), records[i].end(), added.begin(), added.end()) != records[i].end())
      before = i + 1;
  ByteWriter w;
  for (std::size_t i = 0; i <= records.size(); ++i) {
    if (i == before)
      for (const BlobFile& blob : blobs) put_log_record(w, blob_addition(blob));
    if (i < records.size()) put_log_record(w, records[i]);
  }
  return w.take();
}

}  // namespace relmap::storage
