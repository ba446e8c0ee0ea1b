// 128-byte SIFT descriptors as points in space.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace relmap {

inline constexpr std::size_t kDescriptorBytes = 128;
using Descriptor = std::array<std::uint8_t, kDescriptorBytes>;

// Squared L2 distance, at most 128 * 255^2. Written so that the compiler makes 16-bit multiply-adds of it. The thread
// sanitizer would look at each byte by itself, which takes a hundred times as long: descriptors never change.
#ifdef __SANITIZE_THREAD__
[[gnu::no_sanitize("thread")]] std::uint32_t squared_distance(const std::uint8_t* a, const std::uint8_t* b);
#endif
inline std::uint32_t squared_distance(const std::uint8_t* a, const std::uint8_t* b) {
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

}  // namespace relmap
