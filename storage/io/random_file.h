// A file of which any part can be read and written at any time. It is for data that can be made again, so little is
// synced.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "proto/base/bytes.h"
#include "proto/base/status.h"

namespace relmap::storage {

// Thread-safe, except that nobody may read a part while it is written. Errors: IO_ERROR, DISK_FULL.
class RandomFile {
 public:
  // Creates the file if it is missing.
  static Result<std::unique_ptr<RandomFile>> open(const std::string& path);
  // A file without a name, which is gone when it is closed.
  static Result<std::unique_ptr<RandomFile>> open_temporary();
  ~RandomFile();
  RandomFile(const RandomFile&) = delete;
  RandomFile& operator=(const RandomFile&) = delete;

  Result<std::uint64_t> size() const;
  // TRUNCATED if the file ends before that.
  Status read(std::uint64_t offset, void* bytes, std::size_t count) const;
  Status write(std::uint64_t offset, ByteSpan bytes);
  Status truncate(std::uint64_t size);
  // What was written is durable on return.
  Status sync();

  const std::string& path() const { return path_; }

 private:
  RandomFile(int fd, std::string path) : fd_(fd), path_(std::move(path)) {}
  Status failed(const char* what) const;

  const int fd_;
  const std::string path_;
};

}  // namespace relmap::storage
