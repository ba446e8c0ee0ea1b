// Keyframes in a file: for each a u32 length, little-endian, and its canonical bytes. relmap-sim writes such files, and
// so does relmap-frontend --to file.
#pragma once

#include <fstream>
#include <optional>
#include <string>

#include "proto/keyframe/keyframe.h"

namespace relmap::capture {

// By its first bytes; whatever else it is, or isn't, false.
bool is_keyframe_file(const std::string& path);

class KeyframeFileReader {
 public:
  // NO_SUCH_FILE.
  static Result<KeyframeFileReader> open(const std::string& path);

  // The next; nothing at the end. TRUNCATED, CORRUPT, BAD_SIZE, UNKNOWN_PROTOCOL_VERSION: the message says at which
  // byte; nothing can be read after it.
  Result<std::optional<Keyframe>> next();
  // Passes over the next, and gives its first `most` bytes; nothing at the end. TRUNCATED, BAD_SIZE.
  Result<std::optional<Bytes>> skip(std::size_t most);
  void rewind();
  std::uint64_t bytes() const { return bytes_; }  // of the whole file
  std::uint64_t position() const { return position_; }

 private:
  KeyframeFileReader(std::string path, std::ifstream in, std::uint64_t bytes)
      : path_(std::move(path)), in_(std::move(in)), bytes_(bytes) {}
  Status refuse(Reason reason, const std::string& what) const;
  Result<std::uint32_t> next_length();  // of one that is whole
  std::string path_;
  std::ifstream in_;
  std::uint64_t bytes_ = 0, position_ = 0;
};

// Whether a file begins as one of keyframes does.
bool is_keyframe_file(const std::string& path);

class KeyframeFileWriter {
 public:
  // Into `path`.part, which becomes `path` when it is closed: until then a file of that name stays as it is. IO_ERROR;
  // INVALID_ARGUMENT: the file that is there holds no keyframes, and is not replaced.
  static Result<KeyframeFileWriter> create(const std::string& path);
  KeyframeFileWriter(KeyframeFileWriter&&) = default;
  ~KeyframeFileWriter();  // what was written and not closed stays in `path`.part

  Status write(const Keyframe& keyframe);  // IO_ERROR
  Status close();                          // IO_ERROR: something did not reach the disk; `path` is as it was

 private:
  KeyframeFileWriter(std::string path, std::ofstream out) : path_(std::move(path)), out_(std::move(out)) {}
  std::string path_;
  std::ofstream out_;
  bool any_ = false;
};

}  // namespace relmap::capture
