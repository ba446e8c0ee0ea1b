// Compares one descriptor with each of a table, many at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "server/place/descriptor.h"

namespace relmap::place {

// Immutable and thread-safe.
class DescriptorTable {
 public:
  // The instructions that comparisons use: those of every x86-64, AVX2, or AVX-512 with VNNI.
  enum class Kernel : std::uint8_t { kPortable, kAvx2, kVnni };
  // Those that this processor has, the fastest last.
  static std::span<const Kernel> kernels();

  explicit DescriptorTable(std::span<const Descriptor> descriptors, Kernel kernel = kernels().back());

  std::size_t size() const { return size_; }

  // Writes |x|^2 - 2 d.x for each descriptor x of the table to `distances`, of size(). These have the same order as the
  // squared distances from d, from which they all differ by |d|^2, and cost half as much. All kernels write the same.
  void compare(const Descriptor& d, std::span<std::int32_t> distances) const;

 private:
  // Sixteen descriptors, by fours of entries.
  static constexpr std::size_t kLanes = 16, kFours = kDescriptorBytes / 4;
  struct alignas(64) Block {
    std::uint8_t entries[kFours][kLanes][4] = {};
    // |x|^2 - 256 (sum of x). VNNI multiplies unsigned by signed numbers, so d enters with 128 subtracted from each
    // entry, and d.x = (d - 128).x + 128 (sum of x).
    std::int32_t offsets[kLanes] = {};
  };

  template <typename Multiply>
  void compare_blocks(const Descriptor& d, std::span<std::int32_t> distances, const Multiply& multiply) const;

  Kernel kernel_;
  std::size_t size_;
  std::vector<Block> blocks_;
};

}  // namespace relmap::place
