// Reads a raw log (raw_log.h), whatever has become of it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "frontend/capture/log_file.h"
#include "frontend/capture/raw_log.h"
#include "frontend/capture/raw_log_index.h"

namespace relmap::capture {

// Not thread-safe. It sees the log as long as it was when it was opened.
class RawLogReader {
 public:
  // NO_SUCH_FILE, IO_ERROR; CORRUPT: no raw log, or both its headers are damaged; BAD_SIZE: of frames that nobody
  // sends; UNKNOWN_FORMAT_VERSION.
  static Result<RawLogReader> open(const std::string& path);

  const std::string& path() const { return log_.path(); }
  const RawLogHeader& header() const { return header_; }
  const RawLogIndex& index() const { return index_; }
  std::size_t frames() const { return frames_.size(); }
  // Of the n-th frame, by its head.
  std::int64_t time_us(std::size_t frame) const { return index_[frames_[frame]].time_us; }
  // At the end, behind the last whole record: what was being written when its process or machine died.
  std::uint64_t torn_bytes() const { return torn_bytes_; }

  struct Frame {
    RawLogFrame frame;
    std::size_t number = 0;  // among those of the log
    ByteSpan raw;            // good until the next call
  };
  using Record = std::variant<Frame, RawLogEvent>;

  // The next; nothing at the end. IO_ERROR; CORRUPT: a record is damaged, or a stretch in which no record can be found;
  // the message says at which byte, and the call after it gives what comes after it.
  Result<std::optional<Record>> next();

  // What comes next is the n-th frame, or the end; or, of those that come, the first one that is not earlier.
  void seek(std::size_t frame);
  void rewind() { position_ = 0; }
  void skip_before(std::int64_t time_us);

 private:
  RawLogReader(LogFile log, RawLogHeader header, RawLogIndex index, std::uint64_t size);
  std::size_t next_frame() const;  // its number

  LogFile log_;
  RawLogHeader header_;
  RawLogIndex index_;
  std::vector<std::size_t> frames_;  // where in the index
  std::uint64_t torn_bytes_ = 0;
  std::size_t position_ = 0;  // in the index
  Bytes record_;
};

}  // namespace relmap::capture
