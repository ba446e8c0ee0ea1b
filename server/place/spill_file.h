// A file without a name: for what can be made again, and is gone with the process that made it.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "proto/bytes.h"
#include "proto/status.h"

namespace relmap {

// One thread writes, then any number read.
class SpillFile {
 public:
  // In this folder, which must exist. IO_ERROR.
  static Result<std::unique_ptr<SpillFile>> create(const std::string& folder);
  ~SpillFile();
  SpillFile(const SpillFile&) = delete;
  SpillFile& operator=(const SpillFile&) = delete;

  Status append(ByteSpan bytes);
  std::uint64_t size() const { return size_; }
  // Exactly so many bytes.
  Status read(std::uint64_t offset, void* bytes, std::size_t count) const;

 private:
  explicit SpillFile(int fd) : fd_(fd) {}
  const int fd_;
  std::uint64_t size_ = 0;
};

}  // namespace relmap
