// 128-byte SIFT descriptors as points in space.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

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

// Squared L2 distance, at most 128 * 255^2.
RELMAP_READS_DESCRIPTORS inline std::uint32_t squared_distance(const std::uint8_t* a, const std::uint8_t* b) {
#if defined(__SSE2__)
  const __m128i zero = _mm_setzero_si128();
  __m128i sums = zero;
  for (std::size_t i = 0; i < kDescriptorBytes; i += 16) {
    const __m128i x = _mm_loadu_si128(reinterpret_cast<const __m128i*>(a + i));
    const __m128i y = _mm_loadu_si128(reinterpret_cast<const __m128i*>(b + i));
    const __m128i apart = _mm_sub_epi8(_mm_max_epu8(x, y), _mm_min_epu8(x, y));
    const __m128i low = _mm_unpacklo_epi8(apart, zero), high = _mm_unpackhi_epi8(apart, zero);
    sums = _mm_add_epi32(sums, _mm_add_epi32(_mm_madd_epi16(low, low), _mm_madd_epi16(high, high)));
  }
  sums = _mm_add_epi32(sums, _mm_shuffle_epi32(sums, 0x4e));
  sums = _mm_add_epi32(sums, _mm_shuffle_epi32(sums, 0xb1));
  return static_cast<std::uint32_t>(_mm_cvtsi128_si32(sums));
#else
  std::int32_t sum = 0;
  for (std::size_t i = 0; i < kDescriptorBytes; ++i) {
    const auto difference = static_cast<std::int16_t>(a[i] - b[i]);
    sum += difference * difference;
  }
  return static_cast<std::uint32_t>(sum);
#endif
}

inline std::uint32_t squared_distance(const Descriptor& a, const Descriptor& b) {
  return squared_distance(a.data(), b.data());
}

}  // namespace relmap::place
