// Reads a raw log (raw_log.h), also a damaged one.
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

// Sees what was in the log when it was opened. Not thread-safe.
class RawLogReader {
 public:
  // NO_SUCH_FILE, IO_ERROR; CORRUPT if it is no raw log or both its headers are damaged; BAD_SIZE if its header states
  // an impossible frame size; UNKNOWN_FORMAT_VERSION.
  static Result<RawLogReader> open(const std::string& path);

  const std::string& path() const { return log_.path(); }
  const RawLogHeader& header() const { return header_; }
  const RawLogIndex& index() const { return index_; }
  std::size_t frames() const { return frames_.size(); }
  // The time of the n-th frame, from its head.
  std::int64_t time_us(std::size_t frame) const { return index_[frames_[frame]].time_us; }
  // Bytes after the last whole record, of a record that was being written when the process or machine died.
  std::uint64_t torn_bytes() const { return torn_bytes_; }

  struct Frame {
    RawLogFrame frame;
    std::size_t number = 0;  // among the frames of the log
    ByteSpan raw;            // valid until the next call
  };
  using Record = std::variant<Frame, RawLogEvent>;

  // Returns the next record; nothing at the end. IO_ERROR; CORRUPT if a record is damaged or no record can be found in
  // a stretch. The message has the byte, and the next call continues after it.
  Result<std::optional<Record>> next();

  // Makes the n-th frame the next record, or the end if there are fewer.
  void seek(std::size_t frame);
  void rewind() { position_ = 0; }
  // Skips to the first of the following frames that is not earlier than that.
  void skip_before(std::int64_t time_us);

 private:
  RawLogReader(LogFile log, RawLogHeader header, RawLogIndex index, std::uint64_t size);
  std::size_t next_frame() const;  // its number

  LogFile log_;
  RawLogHeader header_;
  RawLogIndex index_;
  std::vector<std::size_t> frames_;  // their positions in the index
  std::uint64_t torn_bytes_ = 0;
  std::size_t position_ = 0;  // in the index
  Bytes record_;
};

}  // namespace relmap::capture
