// 128-byte SIFT descriptors as points in space.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace relmap::place {

inline constexpr std::size_t kDescriptorBytes = 128;
using Descriptor = std::array<std::uint8_t, kDescriptorBytes>;

// The thread sanitizer checks each byte that is read, which makes comparisons a hundred times slower. Descriptors never
// change, so functions that compare them are not instrumented.
#ifdef __SANITIZE_THREAD__
#define RELMAP_READS_DESCRIPTORS [[gnu::no_sanitize("thread")]]
#else
#define RELMAP_READS_DESCRIPTORS
#endif

// Squared L2 distance, at most 128 * 255^2. Written so that the compiler turns it into 16-bit multiply-adds.
RELMAP_READS_DESCRIPTORS inline std::uint32_t squared_distance(const std::uint8_t* a, const std::uint8_t* b) {
  std::int32_t sum = 0;
  for (std::size_t i = 0; i < kDescriptorBytes; ++i) {
    const auto difference = static_cast<std::int16_t>(a[i] - b[i]);
    sum += difference * difference;
  }
  return static_cast<std::uint32_t>(sum);
}

inline std::uint32_t squared_distance(const Descriptor& a, const Descriptor& b) {
  return squared_distance(a.data(), b.data());
}

}  // namespace relmap::place
