#include "storage/rocksdb/manifest_log.h"

#include <algorithm>
#include <charconv>

#include "proto/base/crc32c.h"

namespace relmap::storage {

namespace {

// Blocks of 32 KiB; records in one or more pieces, each with a masked CRC, a length and a type (1 whole, 2 first,
// 3 middle, 4 last).
constexpr std::size_t kLogBlock = 32768, kPieceHeader = 7;

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
    const std::uint32_t crc = crc32c(typed);
    w.put(((crc >> 15) | (crc << 17)) + 0xa282ead8u);  // as RocksDB masks it
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
