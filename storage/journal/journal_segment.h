// The bytes of a journal segment: a header, then records one after another (docs/storage-format.md, Segments). Used by
// JournalLog and by the repair of the journal.
//
// A salt is drawn at random when a segment is begun. It stands in the segment's name, its header and each of its
// records, and the records' checksums begin with it. Whoever made a payload could not know the salt, so nothing inside
// a payload can pass for a record. The name has the salt too because a sector that is lost at the head of the file
// would take the header and the first record. Segments of version 1 have no salt; they are read, but never written.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "proto/base/bytes.h"
#include "proto/base/status.h"
#include "storage/io/file.h"
#include "storage/journal/range_crc.h"

namespace relmap::storage {

inline constexpr std::uint32_t kMaxRecordBytes = 256u << 20;

// "journal-00000000000000000001-0123456789abcdef.log"; of version 1 "journal-00000000000000000001.log".
struct SegmentName {
  std::uint64_t first = 0;            // sequence of its first record; at least 1
  std::optional<std::uint64_t> salt;  // nullopt: version 1

  std::string to_string() const;
  static std::optional<SegmentName> parse(const std::string& file);  // nullopt: not a segment
};

std::uint64_t random_salt();
Bytes segment_header(std::uint64_t first, std::uint64_t salt);
void put_journal_record(ByteWriter& w, std::uint64_t salt, std::uint64_t sequence, std::uint64_t acknowledged_through,
                        ByteSpan payload);

struct SegmentRecord {
  std::uint64_t sequence = 0;
  std::uint64_t acknowledged_through = 0;
  std::uint64_t offset = 0, end = 0;  // in the file
  Bytes payload;
};

class SegmentReader {
 public:
  // UNKNOWN_FORMAT_VERSION, IO_ERROR, NO_SUCH_FILE; CORRUPT if an undamaged header has another salt than the name. A
  // damaged header is no error, because each record can be checked by itself.
  static Result<SegmentReader> open(const FileSystem& files, const std::string& path);

  bool header_whole() const { return header_whole_; }
  std::uint64_t size() const { return file_->size(); }
  std::uint64_t first_offset() const;  // of the first record
  // The record at `offset`; nullopt if none begins there, or if it is damaged or cut off.
  Result<std::optional<SegmentRecord>> record_at(std::uint64_t offset) const;
  // The first whole record at `offset` or behind it whose sequence is above `after`; nullopt if there is none. The
  // first call reads the file from there on into memory. Whatever the bytes say, the calls of this and of record_at()
  // that follow, each further on, together take a time in proportion to the file's size. Not thread-safe.
  Result<std::optional<SegmentRecord>> find_after(std::uint64_t offset, std::uint64_t after) const;

 private:
  // The file from `begin` on, once a search has read it.
  struct Searched {
    Searched(std::uint64_t from, Bytes rest) : begin(from), bytes(std::move(rest)), crc(bytes) {}
    const std::uint64_t begin;
    const Bytes bytes;
    const RangeCrc crc;
  };
  std::optional<SegmentRecord> searched_at(std::uint64_t offset, std::uint64_t after, std::uint64_t far) const;

  mutable std::unique_ptr<const Searched> searched_;
  std::unique_ptr<ReadFile> file_;
  std::optional<std::uint64_t> salt_;
  bool header_whole_ = false;
};

}  // namespace relmap::storage
