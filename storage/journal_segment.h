// The bytes of a journal segment: a header, then records one after another. For JournalLog, and for its repair.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "proto/bytes.h"
#include "proto/status.h"
#include "storage/file.h"

namespace relmap {

inline constexpr std::size_t kSegmentHeaderBytes = 24;
inline constexpr std::size_t kRecordHeaderBytes = 24;
inline constexpr std::uint32_t kMaxRecordBytes = 256u << 20;

// The sequence in "journal-00000000000000000001.log"; 0: another file.
std::uint64_t journal_sequence_in(const std::string& name);

Bytes segment_header(std::uint64_t first);
void put_journal_record(ByteWriter& w, std::uint64_t sequence, std::uint64_t acknowledged_through, ByteSpan payload);

struct SegmentRecord {
  std::uint64_t sequence = 0;
  std::uint64_t acknowledged_through = 0;
  std::uint64_t offset = 0, end = 0;  // in the file
  Bytes payload;
};

class SegmentReader {
 public:
  // UNKNOWN_FORMAT_VERSION, IO_ERROR, NO_SUCH_FILE. A damaged header is no error: the records say of themselves what
  // they are.
  static Result<SegmentReader> open(const FileSystem& files, const std::string& path);

  bool header_whole() const { return header_whole_; }
  std::uint64_t size() const { return file_->size(); }
  // The record at `offset`: nullopt if none begins there, or it is damaged or cut off.
  Result<std::optional<SegmentRecord>> record_at(std::uint64_t offset) const;
  // The first whole record with a sequence above `after` that begins at `offset` or later.
  Result<std::optional<SegmentRecord>> find_after(std::uint64_t offset, std::uint64_t after) const;

 private:
  std::unique_ptr<ReadFile> file_;
  bool header_whole_ = false;
};

}  // namespace relmap
