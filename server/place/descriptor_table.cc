#include "server/place/descriptor_table.h"

#include <algorithm>
#include <array>
#include <cstring>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace relmap::place {
namespace {

constexpr std::size_t kLanes = 16, kFours = kDescriptorBytes / 4;
using Shifted = std::array<std::int8_t, kDescriptorBytes>;  // a descriptor with 128 subtracted from each entry
using Lanes = std::int32_t[kLanes];

// These write (d - 128).x of the block's descriptors to `dots`.

RELMAP_READS_DESCRIPTORS void multiply_portably(const Shifted& d, const std::uint8_t (*entries)[kLanes][4],
                                                Lanes& dots) {
  for (std::size_t lane = 0; lane < kLanes; ++lane) dots[lane] = 0;
  for (std::size_t four = 0; four < kFours; ++four)
    for (std::size_t lane = 0; lane < kLanes; ++lane)
      for (std::size_t i = 0; i < 4; ++i) dots[lane] += d[4 * four + i] * entries[four][lane][i];
}

#if defined(__x86_64__)
RELMAP_READS_DESCRIPTORS [[gnu::target("avx2")]] void multiply_avx2(const Shifted& d,
                                                                    const std::uint8_t (*entries)[kLanes][4],
                                                                    Lanes& dots) {
  for (std::size_t half = 0; half < 2; ++half) {
    __m256i sums = _mm256_setzero_si256();
    for (std::size_t four = 0; four < kFours; ++four) {
      const __m256i bytes = _mm256_load_si256(reinterpret_cast<const __m256i*>(entries[four][8 * half]));
      // Entries 0 and 2 of the four, and entries 1 and 3, each as 16-bit numbers.
      const auto pair = [&](std::size_t i) {
        return static_cast<std::int32_t>(static_cast<std::uint32_t>(d[4 * four + i + 2]) << 16 |
                                         static_cast<std::uint16_t>(d[4 * four + i]));
      };
      sums = _mm256_add_epi32(
          sums, _mm256_madd_epi16(_mm256_and_si256(bytes, _mm256_set1_epi16(0xff)), _mm256_set1_epi32(pair(0))));
      sums = _mm256_add_epi32(sums, _mm256_madd_epi16(_mm256_srli_epi16(bytes, 8), _mm256_set1_epi32(pair(1))));
    }
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(&dots[8 * half]), sums);
  }
}

RELMAP_READS_DESCRIPTORS [[gnu::target("avx512f,avx512vnni")]] void multiply_vnni(
    const Shifted& d, const std::uint8_t (*entries)[kLanes][4], Lanes& dots) {
  __m512i sums[2] = {_mm512_setzero_si512(), _mm512_setzero_si512()};  // two, since a sum waits for the one before
  for (std::size_t four = 0; four < kFours; ++four) {
    std::int32_t of_d;
    std::memcpy(&of_d, &d[4 * four], sizeof of_d);
    sums[four % 2] = _mm512_dpbusd_epi32(sums[four % 2], _mm512_load_si512(entries[four]), _mm512_set1_epi32(of_d));
  }
  _mm512_storeu_si512(dots, _mm512_add_epi32(sums[0], sums[1]));
}
#endif

}  // namespace

std::span<const DescriptorTable::Kernel> DescriptorTable::kernels() {
  static constexpr Kernel kAll[] = {Kernel::kPortable, Kernel::kAvx2, Kernel::kVnni};
#if defined(__x86_64__)
  static const std::size_t count = !__builtin_cpu_supports("avx2")                                               ? 1
                                   : !__builtin_cpu_supports("avx512f") || !__builtin_cpu_supports("avx512vnni") ? 2
                                                                                                                 : 3;
#else
  constexpr std::size_t count = 1;
#endif
  return std::span(kAll).first(count);
}

RELMAP_READS_DESCRIPTORS DescriptorTable::DescriptorTable(std::span<const Descriptor> descriptors, Kernel kernel)
    : kernel_(kernel), size_(descriptors.size()), blocks_((descriptors.size() + kLanes - 1) / kLanes) {
  for (std::size_t i = 0; i < size_; ++i) {
    Block& block = blocks_[i / kLanes];
    for (std::size_t e = 0; e < kDescriptorBytes; ++e) {
      const std::int32_t entry = descriptors[i][e];
      block.entries[e / 4][i % kLanes][e % 4] = descriptors[i][e];
      block.offsets[i % kLanes] += entry * entry - 256 * entry;
    }
  }
}

template <typename Multiply>
RELMAP_READS_DESCRIPTORS void DescriptorTable::compare_blocks(const Descriptor& d, std::span<std::int32_t> distances,
                                                              const Multiply& multiply) const {
  Shifted shifted;
  for (std::size_t e = 0; e < kDescriptorBytes; ++e) shifted[e] = static_cast<std::int8_t>(d[e] - 128);
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    alignas(64) Lanes dots;
    multiply(shifted, blocks_[b].entries, dots);
    const std::size_t first = b * kLanes, count = std::min(kLanes, size_ - first);
    for (std::size_t lane = 0; lane < count; ++lane)
      distances[first + lane] = blocks_[b].offsets[lane] - 2 * dots[lane];
  }
}

RELMAP_READS_DESCRIPTORS void DescriptorTable::compare(const Descriptor& d, std::span<std::int32_t> distances) const {
  switch (kernel_) {
#if defined(__x86_64__)
    case Kernel::kVnni:
      return compare_blocks(d, distances, multiply_vnni);
    case Kernel::kAvx2:
      return compare_blocks(d, distances, multiply_avx2);
#endif
    default:
      return compare_blocks(d, distances, multiply_portably);
  }
}

}  // namespace relmap::place
