// CRC32C of any range of some bytes, in a time that does not grow with the range. Where a search tries many ranges that
// overlap, as those do that a forged or damaged journal claims, it takes no longer than reading the bytes once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "proto/base/bytes.h"

namespace relmap::storage {

class RangeCrc {
 public:
  // Reads all bytes once. They must outlive the result and not change.
  explicit RangeCrc(ByteSpan bytes);

  // crc32c(bytes.subspan(from, size), crc). The range must lie within the bytes.
  std::uint32_t of(std::size_t from, std::size_t size, std::uint32_t crc = 0) const;

 private:
  std::uint32_t before(std::size_t end) const;  // of the first `end` bytes

  ByteSpan bytes_;
  std::vector<std::uint32_t> marks_;  // of the first 0, kStep, 2 kStep, ... bytes
};

}  // namespace relmap::storage
