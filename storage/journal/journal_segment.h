// The bytes of a journal segment: a header, then records one after another (docs/storage-format.md, Segments). For
// JournalLog, and for its repair.
//
// A salt, drawn at random when a segment is begun, stands in its name, its header and each of its records, and is what
// their checksums begin with. Whoever made a payload could not know it, so nothing inside one can pass for a record.
// The name has it too because a sector that is lost at the head of the file would take header and first record.
// Segments of version 1 have none; they are read, and never written.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "proto/base/bytes.h"
#include "proto/base/status.h"
#include "storage/io/file.h"

namespace relmap::storage {

inline constexpr std::uint32_t kMaxRecordBytes = 256u << 20;

// "journal-00000000000000000001-0123456789abcdef.log"; of version 1 "journal-00000000000000000001.log".
struct SegmentName {
  std::uint64_t first = 0;            // sequence of its first record; 1 and above
  std::optional<std::uint64_t> salt;  // none: of version 1

  std::string to_string() const;
  static std::optional<SegmentName> parse(const std::string& file);  // nullopt: another file
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
  // UNKNOWN_FORMAT_VERSION, IO_ERROR, NO_SUCH_FILE; CORRUPT if a whole header has another salt than the name. A damaged
  // header is no error: the records say of themselves what they are.
  static Result<SegmentReader> open(const FileSystem& files, const std::string& path);

  bool header_whole() const { return header_whole_; }
  std::uint64_t size() const { return file_->size(); }
  std::uint64_t first_offset() const;  // of the first record
  // The record at `offset`: nullopt if none begins there, or it is damaged or cut off.
  Result<std::optional<SegmentRecord>> record_at(std::uint64_t offset) const;
  // The first whole record with a sequence above `after` that begins at `offset` or later.
  Result<std::optional<SegmentRecord>> find_after(std::uint64_t offset, std::uint64_t after) const;

 private:
  std::unique_ptr<ReadFile> file_;
  std::optional<std::uint64_t> salt_;
  bool header_whole_ = false;
};

}  // namespace relmap::storage
