// The few calls on files that a log makes, with errors that say what and where.
#pragma once

#include <span>
#include <string>
#include <utility>

#include "proto/base/bytes.h"
#include "proto/base/status.h"

namespace relmap::capture {

class LogFile {
 public:
  // For appending. INVALID_ARGUMENT: there is something in a file of that name, or another process has it; IO_ERROR,
  // DISK_FULL.
  static Result<LogFile> create(const std::string& path);
  // For reading. NO_SUCH_FILE: it cannot be opened.
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
  // All of it. IO_ERROR, DISK_FULL: some of it may stand there.
  Status append(ByteSpan bytes);
  // On disk, but for the time of its last change. IO_ERROR, DISK_FULL.
  Status sync();
  // What stands behind is gone; nothing where that fails.
  void cut(std::uint64_t bytes);
  // All that is asked for. IO_ERROR; TRUNCATED: the file ends before.
  Status read(std::uint64_t offset, std::span<std::uint8_t> bytes) const;

 private:
  LogFile(std::string path, int file) : path_(std::move(path)), file_(file) {}
  std::string path_;
  int file_ = -1;  // descriptor
};

// So that a file that was made in the folder of `path` stays there. IO_ERROR.
Status sync_folder_of(const std::string& path);

}  // namespace relmap::capture
