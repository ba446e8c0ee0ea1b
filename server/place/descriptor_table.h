// Compares one descriptor with each of a table, eight at a time.
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
  explicit DescriptorTable(std::span<const Descriptor> descriptors);

  std::size_t size() const { return size_; }

  // Writes |x|^2 - 2 d.x for each descriptor x of the table to `distances`, of size(). These have the same order as the
  // squared distances from d, from which they all differ by |d|^2, and cost half as much.
  void compare(const Descriptor& d, std::span<std::int32_t> distances) const;

 private:
  // Eight descriptors, by pairs of entries.
  static constexpr std::size_t kLanes = 8;
  struct alignas(32) Block {
    std::int16_t entries[kDescriptorBytes / 2][kLanes][2] = {};
    std::int32_t squared_length[kLanes] = {};
  };

  void compare_portably(const Descriptor& d, std::span<std::int32_t> distances) const;
#if defined(__x86_64__)
  void compare_avx2(const Descriptor& d, std::span<std::int32_t> distances) const;
#endif

  std::size_t size_;
  std::vector<Block> blocks_;
};

}  // namespace relmap::place
