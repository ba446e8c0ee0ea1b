// Owns a file descriptor.
#pragma once

#include <unistd.h>

#include <utility>

namespace relmap::iidc::dc1394 {

class FileHandle {
 public:
  FileHandle() = default;
  explicit FileHandle(int file) : file_(file) {}
  ~FileHandle() { reset(); }
  FileHandle(FileHandle&& other) noexcept : file_(std::exchange(other.file_, -1)) {}
  FileHandle& operator=(FileHandle&& other) noexcept {
    if (this != &other) reset();
    file_ = std::exchange(other.file_, file_);
    return *this;
  }

  int get() const { return file_; }
  explicit operator bool() const { return file_ >= 0; }
  void reset() {
    if (file_ >= 0) ::close(file_);
    file_ = -1;
  }

 private:
  int file_ = -1;
};

}  // namespace relmap::iidc::dc1394
