// Where the records of a raw log stand. NAME.idx beside the log NAME keeps it, so that a long log need not be gone
// through to be opened; the log alone says the same.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "frontend/capture/log_file.h"
#include "frontend/capture/raw_log.h"

namespace relmap::capture {

struct RawLogEntry {
  // Of records as raw_log::Kind; kDamage: a stretch in which no record can be found.
  static constexpr auto kDamage = static_cast<raw_log::Kind>(0);

  raw_log::Kind kind = kDamage;
  std::uint64_t offset = 0;  // in the log
  std::uint32_t bytes = 0;   // of a record's body
  std::int64_t time_us = 0;
  std::uint64_t number = 0;  // as raw_log::Head; of damage: how many bytes long it is

  RawLogEntry() = default;
  RawLogEntry(const raw_log::Head& head, std::uint64_t at)
      : kind(head.kind), offset(at), bytes(head.bytes), time_us(head.time_us), number(head.number) {}

  std::uint64_t end() const { return offset + (kind == kDamage ? number : raw_log::kHeadBytes + bytes); }
  bool is_of(const raw_log::Head& head) const { return *this == RawLogEntry(head, offset); }
  bool operator==(const RawLogEntry&) const = default;
};

// Each begins where the one before it ends.
using RawLogIndex = std::vector<RawLogEntry>;

std::string raw_log_index_path(const std::string& log);
std::uint64_t end_of(const RawLogIndex& index);  // of the last record

// All records of the first `size` bytes of a log, by their heads; those that `index` has already are not read again.
// What stands behind the last one is torn. IO_ERROR.
Status scan_raw_log(const LogFile& log, std::uint64_t size, RawLogIndex& index);

// All that is sound of the bytes of an index, up to the first thing that isn't.
RawLogIndex parse_raw_log_index(ByteSpan bytes);

// What NAME.idx knows of the log, as far as it holds for it; then the log is asked. What is new is written to NAME.idx
// where that can be. IO_ERROR.
Result<RawLogIndex> load_raw_log_index(const LogFile& log, std::uint64_t size);

// Writes NAME.idx beside a log that is being written. What it cannot write it leaves out: it is made again from the
// log.
class RawLogIndexWriter {
 public:
  explicit RawLogIndexWriter(const std::string& path);  // of the index; what stands there is written over
  void add(const RawLogEntry& entry);                   // written by flush()
  bool flush();                                         // false: not all that was ever added stands there

 private:
  std::optional<LogFile> file_;
  ByteWriter pending_;
  std::uint32_t crc_ = 0;
};

}  // namespace relmap::capture
