// The positions of the records of a raw log. They are kept in NAME.idx beside the log NAME, so that a long log need not
// be scanned when it is opened. The index can always be made again from the log.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "frontend/capture/log_file.h"
#include "frontend/capture/raw_log.h"

namespace relmap::capture {

struct RawLogEntry {
  // The kind of an entry that is not a record but a stretch in which no record can be found.
  static constexpr auto kDamage = static_cast<raw_log::Kind>(0);

  raw_log::Kind kind = kDamage;
  std::uint64_t offset = 0;  // in the log
  std::uint32_t bytes = 0;   // of a record's body
  std::int64_t time_us = 0;
  std::uint64_t number = 0;  // as in raw_log::Head; for damage, its length in bytes

  RawLogEntry() = default;
  RawLogEntry(const raw_log::Head& head, std::uint64_t at)
      : kind(head.kind), offset(at), bytes(head.bytes), time_us(head.time_us), number(head.number) {}

  std::uint64_t end() const { return offset + (kind == kDamage ? number : raw_log::kHeadBytes + bytes); }
  bool is_of(const raw_log::Head& head) const { return *this == RawLogEntry(head, offset); }
  bool operator==(const RawLogEntry&) const = default;
};

// Each entry begins where the one before it ends.
using RawLogIndex = std::vector<RawLogEntry>;

std::string raw_log_index_path(const std::string& log);
std::uint64_t end_of(const RawLogIndex& index);  // end of the last record

// Adds to `index` the records in the first `size` bytes of a log, by their heads. Records that `index` already has are
// not read again. Bytes after the last whole record are left out. IO_ERROR.
Status scan_raw_log(const LogFile& log, std::uint64_t size, RawLogIndex& index);

// Parses the bytes of an index up to the first damage.
RawLogIndex parse_raw_log_index(ByteSpan bytes);

// Loads NAME.idx as far as it agrees with the log, and scans the rest of the log. New entries are written to NAME.idx
// if possible. IO_ERROR.
Result<RawLogIndex> load_raw_log_index(const LogFile& log, std::uint64_t size);

// Writes NAME.idx beside a log that is being written. It stops silently if it cannot write, since the index can be made
// again from the log.
class RawLogIndexWriter {
 public:
  explicit RawLogIndexWriter(const std::string& path);  // of the index, which is overwritten
  void add(const RawLogEntry& entry);                   // written by flush()
  bool flush();                                         // false if not all entries added so far have been written

 private:
  std::optional<LogFile> file_;
  ByteWriter pending_;
  std::uint32_t crc_ = 0;
};

}  // namespace relmap::capture
