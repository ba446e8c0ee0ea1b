// File operations of a log, with errors that name the operation and the path.
#pragma once

#include <span>
#include <string>
#include <utility>

#include "proto/base/bytes.h"
#include "proto/base/status.h"

namespace relmap::capture {

class LogFile {
 public:
  // Creates a file for appending. INVALID_ARGUMENT if a file of that name is not empty, or another process uses it;
  // IO_ERROR, DISK_FULL.
  static Result<LogFile> create(const std::string& path);
  // Opens a file for reading. NO_SUCH_FILE if it cannot be opened.
  static Result<LogFile> open(const std::string& path);
  LogFile(LogFile&& other) noexcept : path_(std::move(other.path_)), file_(std::exchange(other.file_, -1)) {}
  LogFile& operator=(LogFile&& other) noexcept {
    std::swap(path_, other.path_);
    std::swap(file_, other.file_);
    return *this;
  }
  ~LogFile();

  const std::string& path() const { return path_; }
  Result<std::uint64_t> size() const;  // IO_ERROR
  // Appends all bytes. IO_ERROR, DISK_FULL; some of the bytes may then have been written.
  Status append(ByteSpan bytes);
  // Writes the data to disk (but not the time of the last change). IO_ERROR, DISK_FULL.
  Status sync();
  // Truncates the file to a size; does nothing if that fails.
  void cut(std::uint64_t bytes);
  // Fills `bytes`. IO_ERROR; TRUNCATED if the file ends before that.
  Status read(std::uint64_t offset, std::span<std::uint8_t> bytes) const;

 private:
  LogFile(std::string path, int file) : path_(std::move(path)), file_(file) {}
  std::string path_;
  int file_ = -1;  // descriptor
};

// Makes the creation of a file in the folder of `path` durable. IO_ERROR.
Status sync_folder_of(const std::string& path);

}  // namespace relmap::capture
