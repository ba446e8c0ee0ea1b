// Files of keyframes: for each keyframe a little-endian u32 length and its canonical bytes. relmap-sim and
// relmap-frontend --to file write such files.
#pragma once

#include <fstream>
#include <optional>
#include <string>

#include "proto/keyframe/keyframe.h"

namespace relmap::capture {

// Whether a file begins like a file of keyframes; false if it cannot be read.
bool is_keyframe_file(const std::string& path);

class KeyframeFileReader {
 public:
  // NO_SUCH_FILE.
  static Result<KeyframeFileReader> open(const std::string& path);

  // Returns the next keyframe; nothing at the end. TRUNCATED, CORRUPT, BAD_SIZE, UNKNOWN_PROTOCOL_VERSION; the message
  // has the byte, and nothing can be read after it.
  Result<std::optional<Keyframe>> next();
  // Skips the next keyframe and returns its first bytes, at most `max_bytes`; nothing at the end. TRUNCATED, BAD_SIZE.
  Result<std::optional<Bytes>> skip(std::size_t max_bytes);
  void rewind();
  std::uint64_t bytes() const { return bytes_; }  // of the whole file
  std::uint64_t position() const { return position_; }

 private:
  KeyframeFileReader(std::string path, std::ifstream in, std::uint64_t bytes)
      : path_(std::move(path)), in_(std::move(in)), bytes_(bytes) {}
  Status refuse(Reason reason, const std::string& what) const;
  Result<std::uint32_t> next_length();  // of the next keyframe, if all of it is there
  std::string path_;
  std::ifstream in_;
  std::uint64_t bytes_ = 0, position_ = 0;
};

class KeyframeFileWriter {
 public:
  // Writes to `path`.part, which replaces `path` at close(). IO_ERROR; INVALID_ARGUMENT if `path` exists and is no file
  // of keyframes.
  static Result<KeyframeFileWriter> create(const std::string& path);
  KeyframeFileWriter(KeyframeFileWriter&&) = default;
  ~KeyframeFileWriter();  // without close(), what was written stays in `path`.part

  Status write(const Keyframe& keyframe);  // IO_ERROR
  Status close();                          // IO_ERROR if not everything reached the disk; `path` is then unchanged

 private:
  KeyframeFileWriter(std::string path, std::ofstream out) : path_(std::move(path)), out_(std::move(out)) {}
  std::string path_;
  std::ofstream out_;
  bool any_ = false;
};

}  // namespace relmap::capture
